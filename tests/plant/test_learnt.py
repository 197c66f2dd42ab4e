"""A learnt term: linear between its knots, zero outside, kept in plant files."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from epv_env.plant.effects.learnt import KNOTS, STATES, LearntTerm, learnt_value
from epv_env.plant.effects.registry import Effects, effect_constants
from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant, PlantFileError, load_plant, save_plant
from epv_env.plant.region import Region

CALIBRATED = Parameters.calibrated()
SMALL = {"f1": 0.05, "f2": 0.005, "f4": 0.3, "f6": 0.03, "f7": 0.05}
"""Small terms by equation [unit of EQUATIONS]."""
REACHED = {
    "p1 - p2": (0.0, 6e5),
    "p3": (1e5, 12e5),
    "xPV": (0.0, 2e-3),
    "I": (0.0, 0.3),
    "U": (0.0, 24.0),
}


def term(equation: str, state: str, values=(0.4, 1.0, 0.2, -0.5, -1.0, 0.3, 0.8, 0.6, 0.5)):
    unit, state_unit = LearntTerm.units(equation, state)
    low, high = REACHED.get(state, (-1.0, 1.0))
    return LearntTerm(
        equation=equation, unit=unit, state=state, state_unit=state_unit, low=low, high=high,
        values=tuple(SMALL[equation] * v for v in values), sd=(0.1 * SMALL[equation],) * KNOTS,
        share_closed=(0.8, 0.7, 0.9),
    )  # fmt: skip


@pytest.mark.parametrize("state", STATES)
def test_a_term_is_linear_between_its_knots_and_zero_outside(state):
    own = term("f4", state)
    e = Effects(*effect_constants(CALIBRATED.replace(**own.parameters))[:, 0])
    width = (own.high - own.low) / (KNOTS - 1)
    knots = np.linspace(own.low - width, own.high + width, KNOTS + 2)
    at = np.linspace(own.low - 3 * width, own.high + 3 * width, 60)
    parts = {
        name: at / sum(w * w for w in STATES[state][1].values()) * weight
        for name, weight in STATES[state][1].items()
    }
    found = [
        learnt_value(
            State(**{name: float(parts[name][i]) if name in parts else 0.0 for name in State._fields}),
            float(parts["U"][i]) if "U" in parts else 0.0,
            e,
        )
        for i in range(len(at))
    ]
    expected = np.interp(at, knots, [0.0, *own.values, 0.0])
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_term_travels_in_a_plant_file_and_acts_in_the_environment(tmp_path):
    own = term("f1", "p1 - p2")
    parameters = CALIBRATED.replace(**own.parameters)
    plant = replace(
        Plant.calibrated(), parameters=parameters, region=Region(centre=parameters), learnt_term=own
    )
    save_plant(plant, tmp_path / "plant.json")
    found = load_plant(tmp_path / "plant.json")
    assert found.learnt_term == own
    assert dict(found.parameters) == dict(parameters)
    env = gym.make("EPValve-v0", plant=tmp_path / "plant.json", parameters="exact")
    plain = gym.make("EPValve-v0", parameters="exact")
    last = [[e.reset(seed=1), *(e.step(1) for _ in range(40))][-1][0] for e in (env, plain)]
    assert not np.array_equal(*last)


def test_a_term_in_another_unit_is_refused(tmp_path):
    own = term("f1", "p1 - p2")
    plant = replace(Plant.calibrated(), parameters=CALIBRATED.replace(**own.parameters), learnt_term=own)
    path = tmp_path / "plant.json"
    save_plant(plant, path)
    path.write_text(path.read_text().replace('"g/s"', '"mg/s"'))
    with pytest.raises(PlantFileError, match="learnt_term"):
        load_plant(path)
