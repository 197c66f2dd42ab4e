"""A law: linear between its knots, a factor of its effect's strength, kept in plant files."""

import json
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from epv_env.common.law_form import KNOTS
from epv_env.plant.channels import readings
from epv_env.plant.effects.law import ARGUMENTS, SLOTS, Law, Terms, growth, laws_of, placed
from epv_env.plant.effects.registry import PLACES, Effects, effect, effect_constants, with_laws
from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import FORMAT, Plant, PlantFileError, load_plant, save_plant
from epv_env.plant.region import Region
from epv_env.plant.simulate import energised, simulate

CALIBRATED = Parameters.calibrated()
GROWTH = (0.4, 1.0, 0.2, -0.5, -2.0, 0.3, 0.8, 0.6, 0.5)
GIVEN: Any = {"effect": "piston_friction", "argument": "p3", "unit": "Pa", "low": 1e5, "high": 9e5}
ENDS = {
    "Pa": (1e5, 9e5),
    "m": (0.0, 2e-3),
    "m/s": (-0.5, 0.5),
    "A": (0.0, 0.3),
    "K": (0.0, 60.0),
    "1": (-0.1, 0.1),
}
LAWFUL = [name for name in PLACES if effect(name).strength]


def law(name: str, argument: str = "p3", growth: tuple[float, ...] = GROWTH, slot: int = 1):
    return placed(slot, PLACES[name], argument, *ENDS[ARGUMENTS[argument][0]], growth)


def trial(name: str) -> dict[str, float]:
    """Every size of an effect, as a fit begins with it or as sweeps draw it."""
    return {s.symbol: s.trials[0] if s.trials else s.typical for s in effect(name).sizes}


def openings(p: Any) -> np.ndarray:
    """Readings of p2, p3 and I, (3, samples) or (3, samples, n) [Pa, A]; no law shortens the step."""
    U = np.where(np.arange(600) % 300 // 50 % 5 > 0, 0.0, 24.0)
    run = simulate(p, initial=energised(p, p1=12e5, p2=7e5, U=24.0), U=U, period=1e-3, step=1e-4)
    return np.array([readings(run.state, p)[name] for name in ("p2", "p3", "I")])


@pytest.mark.parametrize("slot", SLOTS)
@pytest.mark.parametrize("argument", ARGUMENTS)
def test_growth_is_linear_between_its_knots_and_constant_beyond(argument, slot):
    (low, high), weights = ENDS[ARGUMENTS[argument][0]], ARGUMENTS[argument][1]
    e = Effects(*effect_constants({**CALIBRATED, **law("seat_leak", argument, slot=slot)})[:, 0])
    at = np.linspace(low - 0.4 * (high - low), high + 0.4 * (high - low), 61)
    parts = {name: at * weight / len(weights) for name, weight in weights.items()}
    states = [State(*(parts.get(name, 0.0 * at)[k] for name in State._fields)) for k in range(61)]
    terms = Terms(*(getattr(e, f"law{slot}_{name}") for name in Terms._fields))
    found = [growth(q, terms) for q in states]
    met = np.abs(at) if argument.startswith("|") else at
    expected = np.interp(met, np.linspace(low, high, KNOTS), GROWTH)
    np.testing.assert_allclose(found, np.maximum(expected, -1.0), rtol=0, atol=1e-9)


@pytest.mark.parametrize("growths", [(0.5,), (0.25, 0.2), (0.25, 0.6, 0.2, -0.375)], ids=len)
def test_constant_laws_are_a_larger_effect_by_the_product_of_their_factors(growths):
    p = CALIBRATED.replace(F_PV=4.0)
    for slot, constant in enumerate(growths, start=1):
        p = p.replace(**law("piston_friction", growth=KNOTS * (constant,), slot=slot))
    np.testing.assert_allclose(
        openings(p), openings(CALIBRATED.replace(F_PV=6.0)), rtol=1e-9, atol=1e-12
    )


@pytest.mark.parametrize("slot", SLOTS[1:])
def test_a_law_acts_alike_in_every_slot(slot):
    p = CALIBRATED.replace(F_PV=4.0)
    first, other = (openings(p.replace(**law("piston_friction", slot=s))) for s in (1, slot))
    assert np.max(np.abs(first - openings(p))) > 1e3
    np.testing.assert_allclose(other, first, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("used", "further"), [(1, 2), (3, 4)], ids=["usual kernel", "many laws"])
def test_a_further_law_of_an_effect_that_is_off_changes_nothing_to_the_bit(used, further):
    p = CALIBRATED.replace(F_PV=4.0)
    for slot in range(1, used + 1):
        p = p.replace(**law("piston_friction", list(ARGUMENTS)[2 * slot], slot=slot))
    idle = law("flow_force", "xPV", KNOTS * (-0.5,), slot=further)  # growth would shorten steps
    found = openings(p.replace(**idle))
    np.testing.assert_array_equal(found, openings(p))


def each_with_its_law(growth: float, changed: dict[str, Any]) -> np.ndarray:
    """Outputs of a plant for each lawful effect, which has a law of constant growth, (3, samples, n)."""
    each = {"law1_effect": np.array([float(PLACES[name]) for name in LAWFUL])}
    return openings({**CALIBRATED, **law("seat_leak", growth=KNOTS * (growth,)), **each, **changed})


@pytest.mark.parametrize("changed", [{}, {"theta_coil": 20.0}], ids=["nominal", "extended kernel"])
def test_a_law_of_an_effect_that_is_off_does_nothing(changed):
    found, plain = (each_with_its_law(growth, changed) for growth in (0.5, 0.0))
    np.testing.assert_array_equal(found, plain)


def test_a_law_of_every_effect_changes_readings_by_a_tenth_of_their_noise():
    own = [trial(name) for name in LAWFUL]
    sizes = {s: np.array([each.get(s, 0.0) for each in own]) for each in own for s in each}
    change = np.abs(each_with_its_law(0.5, sizes) - each_with_its_law(0.0, sizes)).max(axis=1)
    felt = np.max(change.T / [980.0, 750.0, 8e-4], axis=1)
    assert {name: f for name, f in zip(LAWFUL, felt, strict=True) if f < 0.1} == {}


@pytest.mark.parametrize("name", LAWFUL)
def test_a_law_multiplies_the_strengths_of_its_effect_and_nothing_else(name):
    every = {symbol: size for other in LAWFUL for symbol, size in trial(other).items()}
    e = Effects(*effect_constants({**CALIBRATED, **every, **law(name, growth=KNOTS * (0.5,))})[:, 0])
    expected = {strength: 1.5 * getattr(e, strength) for strength in effect(name).strength}
    found = with_laws(State(*[0.0] * len(State._fields)), e, True)
    assert all(expected.values())
    assert found._asdict() == {**e._asdict(), **expected}


def test_laws_travel_in_a_plant_file_and_act_in_the_environment(tmp_path):
    path, last, own = tmp_path / "plant.json", [], CALIBRATED.replace(F_PV=8.0, cflow=0.5)
    laws = law("piston_friction") | law("flow_force", "xPV", slot=2) | law("flow_force", "p2", slot=3)
    laws |= law("piston_friction", "|vPV|", slot=4)
    for p in (own, own.replace(**laws)):
        save_plant(Plant(parameters=p, region=Region(centre=p)), path)
        assert dict(load_plant(path).parameters) == dict(p)
        env = gym.make("EPValve-v0", plant=path, parameters="exact")
        last.append([env.reset(seed=1), *(env.step(k // 20 % 2) for k in range(80))][-1][0])
    assert not np.array_equal(*last)
    assert laws_of(load_plant(path).parameters, tuple(PLACES))[0] == Law(**GIVEN, growth=GROWTH)


@pytest.mark.parametrize(
    ("laws", "message"),
    [
        ([GIVEN | {"unit": "bar"}], r"laws\[0\]: .*'p3' in 'bar' is unknown: choose one of p1"),
        ([GIVEN | {"effect": "rust"}], "law of 'rust': choose one of armature_bounce"),
        ([GIVEN] * 5, "laws has 5 entries: give at most 4"),
        ([GIVEN | {"growth": [0.1] * 8}], r"laws\[0\]: .*give low < high and 9 numbers as growth"),
        ([GIVEN | {"growth": [9.0] * 9}], r"law1_1 = 9 1 is outside its domain \[-3, 3\].*give a value"),
    ],
)
def test_a_wrong_law_is_refused_in_a_sentence(tmp_path, laws, message):
    laws, path = [{"growth": [0.1] * KNOTS} | each for each in laws], tmp_path / "plant.json"
    path.write_text(json.dumps({"format": FORMAT, "parameters": {}, "laws": laws}))
    with pytest.raises(PlantFileError, match=message):
        load_plant(path)
