"""The FMU of an exported policy decides as the policy, and closes the loop with the plant's FMU."""

import ctypes
import shutil
from pathlib import Path

import numpy as np
import pytest

from controllers.policy import TRAINED
from epv_env.plant.plantfile import Plant
from tests.training.exports import PERIODS, column, export
from tests.training.fmu.unit import OK, Instance, Unit
from training.deploy.fmu.archive import fmu
from training.deploy.fmu.models import plant_model

pytestmark = [
    pytest.mark.training,
    pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here"),
]

PERIOD = 5e-3
HALF_A_BAR = 5e4


@pytest.fixture(scope="module")
def ecu(tmp_path_factory) -> Path:
    """The export of a policy that comes with the package."""
    folder = tmp_path_factory.mktemp("policy") / "ecu"
    assert export(TRAINED, folder, "--fmu") == 0
    return folder


@pytest.fixture
def unit(ecu, tmp_path) -> Unit:
    return Unit((ecu / "epv_policy.fmu").read_bytes(), tmp_path / "policy")


def readings(folder: Path, episode: int) -> list[dict[str, float]]:
    """Inputs of the unit in each period of an episode of states.csv."""
    names = {"p1": 1e5, "p2": 1e5, "p3": 1e5, "target": 1e5, "current": 1.0}
    header = (folder / "states.csv").read_text().splitlines()[0].split(",")
    columns = {name: next(each for each in header if each.startswith(name)) for name in names}
    table = {name: scale * column(folder, columns[name])[episode] for name, scale in names.items()}
    table["p2_target"], table["I"] = table.pop("target"), table.pop("current")
    return [{name: float(values[k]) for name, values in table.items()} for k in range(PERIODS)]


def decisions(unit: Unit, inputs: list[dict[str, float]]) -> list[float]:
    """What the unit decides in each period: the first at its start, the next when a step begins."""
    instance = Instance(unit).start(inputs[0])
    found = instance.get("coil")
    assert instance.step(PERIOD) == OK
    for each in inputs[1:]:
        assert instance.step(PERIOD, **each) == OK
        found += instance.get("coil")
    return found


def test_it_decides_as_the_policy_on_visited_states(ecu, unit):
    actions = column(ecu, "decision")
    for episode in range(3):
        assert decisions(unit, readings(ecu, episode)) == list(actions[episode])


def test_the_loop_of_both_units_holds_the_pressure(unit, tmp_path):
    """Communication steps of 1 ms under braking: p2 stays within 0.5 bar of its target."""
    plant = Instance(Unit(fmu(plant_model(Plant.calibrated()), "cc"), tmp_path / "plant")).start()
    policy = Instance(unit).start()
    pressures = []
    for k in range(1000):
        (U,) = policy.get("U")
        assert plant.step(1e-3, U=U, sigma_S=0.004 if k % 500 < 250 else 0.0) == OK
        p1, p2, p3, current = plant.get("p1", "p2", "p3", "I")
        assert policy.step(1e-3, p1=p1, p2=p2, p3=p3, I=current, p2_target=8e5) == OK
        pressures.append(p2)
    assert np.abs(np.array(pressures) - 8e5).max() < HALF_A_BAR
    assert np.ptp(pressures) > 1e3


def test_the_voltage_of_a_decision_is_a_parameter(unit):
    instance = Instance(unit).start({"U_on": 12.0, "p2": 12e5})
    assert instance.get("coil", "U") == [1.0, 12.0]


def test_a_state_saved_while_readings_are_lost_goes_on_the_same(ecu, unit):
    inputs = readings(ecu, 0)
    dead = {"p1": 0.0, "p2": 0.0, "p3": 0.0}
    instance = Instance(unit).start(inputs[0])
    for each in [*inputs[1:100], dead, dead]:
        assert instance.step(PERIOD, **each) == OK
    content, time = instance.bytes_of(instance.saved()), instance.time
    found = []
    for _ in range(2):
        state = instance.state_of(content)
        assert state is not None
        instance.restore(state, time)
        coil = []
        for each in [dead] * 20 + inputs[122:200] + [{"p2": 7e5}] * 10:
            assert instance.step(PERIOD, **each) == OK
            coil += instance.get("coil")
        found.append(coil)
    assert found[0] == found[1]
    assert found[0][2:20] == [1.0] * 18  # the fourth lost period, and the later ones
    assert found[0][-1] == 0.0  # p2 is back, and low: the hysteresis opens


def test_summed_steps_do_not_drift(unit):
    """The plain sum of steps of 0.1 ms is 1e-9 s off after 64 s: a decision came a step early."""
    instance, time, step = Instance(unit).start(), 0.0, ctypes.c_double(1e-4)
    advance, handle = unit.function("DoStep"), ctypes.c_void_p(instance.handle)
    for _ in range(700_000):
        assert advance(handle, ctypes.c_double(time), step, True) == OK
        time += 1e-4
    (decisions,) = np.frombuffer(instance.bytes_of(instance.saved())[-40:-32])  # before phase and times
    assert decisions == 70 / PERIOD
