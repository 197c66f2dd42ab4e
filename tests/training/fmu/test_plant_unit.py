"""The plant's FMU moves as the kernel does, and keeps the contract of its standard."""

import ctypes
import shutil
from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pytest

from epv_env.plant.channels import readings
from epv_env.plant.effects.law import placed
from epv_env.plant.effects.record import Effect
from epv_env.plant.effects.registry import EFFECTS, PLACES
from epv_env.plant.parameters import Parameters, table
from epv_env.plant.plantfile import Plant
from epv_env.plant.valves import Valves
from tests.training.fmu.unit import ERROR, OK, Instance, Unit
from training.deploy.fmu.archive import fmu
from training.deploy.fmu.models import P1_START, P2_START, U_START, plant_model

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here")

VALVES, STEPS, PERIOD = 100, 100, 5e-3
OUTPUTS = ("p1", "p2", "p3", "I")
TENTH_OF_A_MILLIBAR = 10.0
QUICK = 0.1  # s
FINE = 25e-6
"""Integration step at which FMU and kernel differ by nothing but their code [s]."""
SYMBOLS = [symbol for symbol, row in table().items() if row.domain]


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    return Unit(fmu(plant_model(Plant.calibrated()), "cc"), tmp_path_factory.mktemp("fmu"))


def drawn_parameters(rng: np.random.Generator, effects: Sequence[Effect]) -> Parameters:
    """Parameters within 5 % of the calibrated ones, with effects of the largest size that is drawn, of
    any form."""
    changes = {}
    for symbol in ("R", "V2", "V3", "alphaPV", "alphaMV", "RML", "cPV"):
        changes[symbol] = Parameters.calibrated()[symbol] * rng.uniform(0.95, 1.05)
    for effect in effects:
        changes |= {size.symbol: size.drawn[1] for size in effect.drawn[0] if size.drawn}
        forms = {size.symbol: size.domain or (0.0, 0.0) for size in effect.sizes if size.spread}
        changes |= {symbol: rng.uniform(low, high) for symbol, (low, high) in forms.items()}
    return Parameters.calibrated().replace(**changes)


def started(unit: Unit, p: Parameters, **settings: float) -> Instance:
    """An instance with these parameters and settings, its current at rest."""
    return Instance(unit).start({s: p[s] for s in SYMBOLS} | {"I_start": U_START / p["R"]} | settings)


def kernel_of(plants: list[Parameters]) -> Valves:
    """The same valves in the kernel."""
    valves = Valves(len(plants))
    for k, p in enumerate(plants):
        valves.set_parameters(np.array([k]), p)
        state = {
            "p1": P1_START, "p2": P2_START, "p3": P1_START, "xMV": p["xMVmax"],
            "I": U_START / p["R"], "I_coil": U_START / p["R"], "coil_heat": p["theta_coil"],
        }  # fmt: skip
        for name, value in state.items():
            getattr(valves.state, name)[k] = value
    return valves


def test_ten_thousand_random_steps_are_the_kernels(unit):
    """100 plants of other parameters, each effect alone or in a pair, 100 steps of random inputs."""
    rng = np.random.default_rng(5)
    alone, pairs = [[each] for each in EFFECTS], list(combinations(EFFECTS, 2))
    chosen = [*alone, *(pairs[k] for k in rng.choice(len(pairs), VALVES - len(alone), replace=False))]
    plants = [drawn_parameters(rng, effects) for effects in chosen]
    valves = kernel_of(plants)
    valves.step = FINE
    instances = [started(unit, p, longest_step=FINE) for p in plants]
    on, worst, wanted = np.ones(VALVES, dtype=bool), np.zeros(4), np.zeros((VALVES, 4))
    for _ in range(STEPS):
        on ^= rng.random(VALVES) < 0.3
        U = np.where(on, 24.0, 0.0)
        flow = np.where(valves.state.p2 > 3e5, rng.choice([0.0, 0.005, 0.015], VALVES), 0.0)
        valves.inputs.U[:], valves.inputs.sigma_S[:] = U, flow
        valves.advance(PERIOD)
        shown = readings(valves.state, valves.tables.sensors[:VALVES])
        for k, instance in enumerate(instances):
            assert instance.step(PERIOD, U=U[k], sigma_S=flow[k]) == OK, instance.said
        found = np.array([instance.get(*OUTPUTS) for instance in instances])
        wanted = np.stack([shown[name] for name in OUTPUTS], axis=1)
        worst = np.maximum(worst, np.abs(found - wanted).max(axis=0))
    moved = np.ptp(wanted[:, 1])
    assert moved > 1e5  # the valves did not just stand still
    assert np.all(worst[:3] < TENTH_OF_A_MILLIBAR), worst
    assert worst[3] < 1e-4


def test_laws_act_as_in_the_kernel(unit):
    """Four laws, of friction and of the eddy current that the terminals show."""
    growth = (0.0, 0.1, 0.3, 0.5, 0.8, 1.0, 1.0, 0.5, 0.2)
    laws = placed(1, PLACES["piston_friction"], "p3", 1e5, 9e5, growth)
    laws |= placed(2, PLACES["eddy_current"], "I", 0.0, 0.3, growth)
    laws |= placed(3, PLACES["piston_friction"], "|vPV|", 0.0, 0.5, growth[::-1])
    laws |= placed(4, PLACES["eddy_current"], "p1 - p3", 0.0, 6e5, growth[::-1])
    p = Parameters.calibrated().replace(F_PV=5.0, G_eddy=4e-3)
    law, plain = (started(unit, each, longest_step=FINE) for each in (p.replace(**laws), p))
    valves = kernel_of([p.replace(**laws)])
    valves.step = FINE
    felt = np.zeros(4)
    for k in range(60):
        U = 0.0 if k % 30 < 18 else 24.0
        valves.inputs.U[:] = U
        valves.advance(PERIOD)
        assert law.step(PERIOD, U=U) == plain.step(PERIOD, U=U) == OK
        shown = readings(valves.state, valves.tables.sensors[:1])
        wanted = np.array([shown[name][0] for name in OUTPUTS])
        assert np.all(np.abs(np.array(law.get(*OUTPUTS)) - wanted) < [0.1, 0.1, 0.1, 1e-6])
        felt = np.maximum(felt, np.abs(np.array(plain.get(*OUTPUTS)) - wanted))
    assert felt[1] > 1e3
    assert felt[3] > 1e-3


def test_all_states_come_out(unit):
    p = Parameters.calibrated()
    instance, valves = started(unit, p), kernel_of([p])
    valves.inputs.U[:] = 0.0
    valves.advance(0.02)
    assert instance.step(0.02, U=0.0) == OK
    for name, value in valves.state._asdict().items():
        (found,) = instance.get(f"state.{name}")
        np.testing.assert_allclose(found, value[0], rtol=1e-3, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("longest", [20e-3, 5e-3, 1e-3, 0.7e-3])
def test_the_length_of_steps_matters_little(unit, longest):
    """U is discrete: an importer ends its steps at the edges, which therefore stay where they are."""
    (U,) = (v for v in unit.description.iter("ScalarVariable") if v.attrib["name"] == "U")
    assert U.attrib["variability"] == "discrete"
    whole, parts = (started(unit, Parameters.calibrated(), U=0.0) for _ in range(2))
    for k in range(10):
        inputs = {"U": 24.0 * (k % 2)} if k else {}  # the start value of U stays until it is set
        assert whole.step(35e-3, **inputs) == OK
        for step in np.diff([*np.arange(0.0, 35e-3 - 1e-9, longest), 35e-3]):
            assert parts.step(step, **inputs) == OK
    np.testing.assert_allclose(
        whole.get(*OUTPUTS[:3]), parts.get(*OUTPUTS[:3]), atol=TENTH_OF_A_MILLIBAR
    )


def test_a_parameter_counts_if_it_is_set_in_time(unit):
    instance = Instance(unit).start({"R": 50.0})
    assert instance.step(QUICK, U=24.0) == OK
    assert instance.get("I") == pytest.approx([24 / 50])
    assert instance.set({"R": 50.0}) == OK  # its own value: nothing changes
    assert instance.set({"R": 40.0}) == ERROR
    assert instance.said == [
        "parameter R cannot be set while it runs: set it before initialisation ends"
    ]


def test_reset_begins_anew_to_the_bit(unit):
    instance = Instance(unit).start()
    first = []
    for results in (first, []):
        for k in range(5):
            assert instance.step(PERIOD, U=24.0 * (k % 2), sigma_S=0.01) == OK
            results.append(instance.get(*OUTPUTS))
        assert results == first
        assert instance.call("Reset") == OK
        instance.time = 0.0
        instance.start()


def flipped(content: bytes, first: int) -> list[bytes]:
    """The content with one bit of a byte from `first` on flipped, at two hundred places."""
    places = np.random.default_rng(2).integers(first, len(content), 200).tolist()
    return [content[:k] + bytes([content[k] ^ 1 << k % 8]) + content[k + 1 :] for k in places]


def with_nan(content: bytes, first: int) -> bytes:
    """A serial state whose first number, at byte `first`, is NaN; its checksum (FNV-1a) is right."""
    numbers = np.array([np.nan]).tobytes() + content[first + 8 : -8]
    digest = 14695981039346656037
    for byte in numbers:
        digest = (digest ^ byte) * 1099511628211 % 2**64
    return content[:first] + numbers + digest.to_bytes(8, "little")


def test_a_saved_state_goes_on_to_the_bit(unit):
    """With a delayed command under way, and through bytes into another instance."""
    p = {"t_delay": 3e-3}
    instance = Instance(unit).start(p)
    assert instance.step(PERIOD, U=24.0) == OK
    assert instance.step(1e-3, U=0.0) == OK
    state, time = instance.saved(), instance.time
    content = instance.bytes_of(state)

    def goes_on(it: Instance) -> list[float]:
        assert [it.step(2e-3, U=0.0, sigma_S=0.01) for _ in range(10)] == [OK] * 10
        return it.get(*OUTPUTS)

    wanted = goes_on(instance)
    instance.restore(state, time)
    assert goes_on(instance) == wanted
    other = Instance(unit).start()
    again = other.state_of(content)
    assert again is not None
    other.restore(again, time)
    assert goes_on(other) == wanted
    for damaged in (*flipped(content, len(unit.token)), with_nan(content, len(unit.token))):
        assert other.state_of(damaged) is None
        assert other.said[-1] == "these bytes are a damaged state: give those that the unit wrote"
    assert other.state_of(content[:-1]) is None
    assert other.state_of(b"?" * len(content)) is None
    assert other.said[-1] == "these bytes are not a state of this unit: give those that it wrote"


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"R": 4.0}, "R = 4 is outside [35, 50]: give a value inside it"),
        ({"U": float("nan")}, "U = nan is outside [-inf, inf]: give a value inside it"),
        ({"U": float("inf")}, "U = inf is outside [-inf, inf]: give a value inside it"),
        ({"sigma_S": -1.0}, "sigma_S = -1 is outside [0, inf]: give a value inside it"),
        ({"p2": 1e5}, "p2 is computed and cannot be set: set an input or a parameter"),
    ],
)  # fmt: skip
def test_a_senseless_value_is_refused(unit, values, sentence):
    instance = Instance(unit)
    assert instance.set(values) == ERROR
    assert instance.said == [sentence]


def test_a_piston_beyond_its_stop_is_refused(unit):
    with pytest.raises(AssertionError, match="beyond the piston's stop"):
        Instance(unit).start({"xPV_start": 3e-3, "xPVmax": 2e-3})


def test_senseless_calls_are_refused(unit):
    instance = Instance(unit)
    assert instance.step_from(0.0, 1e-3) == ERROR
    assert "a step is not allowed before initialisation" in instance.said[-1]
    instance.start()
    assert instance.step_from(0.0, -1e-3) == ERROR
    for length in (float("nan"), 1e300):  # the second would keep the importer waiting for ever
        assert instance.step_from(0.0, length) == ERROR
        assert "give a positive length of at most an hour" in instance.said[-1]
    assert instance.step_from(1.0, 1e-3) == ERROR
    assert "the step begins at 1 s but the unit is at 0 s" in instance.said[-1]
    assert instance.step_from(0.0, 1e-3) == OK


def test_a_step_past_the_stop_time_is_refused(unit):
    instance = Instance(unit)
    end = [ctypes.c_double(value) for value in (0.0, 0.0, 2e-3)]
    assert instance.call("SetupExperiment", False, end[0], end[1], True, end[2]) == OK
    assert instance.call("EnterInitializationMode") == OK
    assert instance.call("ExitInitializationMode") == OK
    assert instance.step(1e-3, U=24.0) == instance.step(1e-3) == OK
    assert instance.step(1e-3) == ERROR
    assert instance.said[-1].startswith("the step ends at 0.003 s, after the stop time 0.002 s")


def test_another_units_token_is_refused(unit):
    assert not Instance(unit, token="{another}").handle


def test_an_emptied_circuit_ends_the_run_in_a_sentence(unit):
    instance = Instance(unit).start()
    assert instance.step(1.0, U=24.0, sigma_S=0.1) == ERROR
    assert "an empty circuit cannot be consumed from" in instance.said[-1]
    assert instance.step(1e-3) == ERROR
    assert "after a failed step" in instance.said[-1]
    assert instance.call("Reset") == OK
    instance.time = 0.0
    assert instance.start().step(1e-3, U=24.0, sigma_S=0.0) == OK


def test_a_step_to_numbers_beyond_double_precision_fails(unit):
    instance = Instance(unit).start()
    assert instance.step(1e-3, U=1e155) == ERROR
    assert "check that the inputs are physical" in instance.said[-1]


def test_a_finite_reservoir_sags(unit):
    results = []
    for volume in (0.0, 0.02):
        instance = Instance(unit).start({"V1": volume})
        assert instance.step(0.3, U=0.0, sigma_S=0.02) == OK
        results.append(instance.get("p1")[0])
    assert results[0] == P1_START > results[1]
