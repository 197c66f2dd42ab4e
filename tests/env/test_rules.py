"""The reward is the sum of its terms; the compiled step applies the rules of NumPy, to the bit."""

from dataclasses import fields, replace

import numpy as np
import pytest

from epv_env.common.units import BAR
from epv_env.observation import INDEX, encode
from epv_env.plant.channels import MEASURED, SENSORS, readings
from epv_env.reward import RewardTerms, RewardWeights, reward_terms, total
from tests.env.rollouts import ENDING, IDS, actions, native, run

BIASED = {"b_p2": 3e3, "b_p3": -2e3, "g_I": 0.02}
"""Parameters of the sensors alone."""
UNITS = {"p1": BAR, "p2": BAR, "p3": BAR, "I": 1.0}


@pytest.fixture(params=[(i, p) for i in IDS for p in ("sensitive_ten_percent", BIASED)], ids=str)
def running(request):
    """An environment of 20 valves under way, and an action for each."""
    identifier, parameters = request.param
    env = native(identifier, 20, parameters=parameters)
    env.reset(seed=4)
    *earlier, last = actions(identifier, 20, 40)
    for command in earlier:
        env.step(command)
    return env, last


def test_the_reward_is_that_of_reward_terms(running):
    env, action = running
    vented = env.task.valves.state.air_vented.copy()
    result = env.task.step(*env.action.decode(action))
    valves, target = env.task.valves, env.task.target
    terms = reward_terms(
        env.settings.weights,
        period=env.settings.control_period,
        error_bar=valves.state.p2 / BAR - target,
        highest_error_bar=valves.tables.highest[:20] / BAR - target,
        lowest_error_bar=valves.tables.lowest[:20] / BAR - target,
        switchings=result.switchings,
        vented_kg=valves.state.air_vented - vented,
        failed=result.failed,
    )
    np.testing.assert_array_equal(result.figures[: len(RewardTerms._fields)], terms)
    np.testing.assert_array_equal(result.reward, total(terms))


def test_readings_are_those_of_the_sensors(running):
    env, action = running
    task = env.task
    observation = task.step(*env.action.decode(action)).observation
    normal = task._noise[np.arange(20), task.steps % task._noise.shape[1]]
    true = readings(task.valves.state, task.valves.tables.sensors[:20])
    read = {
        name: SENSORS[name].measure(true[name] / UNITS[name], normal[:, k])
        for k, name in enumerate(MEASURED)
    }
    shown = {"p1": read["p1"], "p3": read["p3"], "I": read["I"], "p2_error": read["p2"] - task.target}
    expected = encode({**{name: np.zeros(20) for name in INDEX}, **shown})
    rows = [INDEX[name] for name in shown]
    np.testing.assert_array_equal(observation[:, rows], expected[:, rows])


def test_consumption_is_that_of_the_profiles(running):
    env, action = running
    expected = env.task.consumption.mean_flow(env.task.time(), env.task.period)
    result = env.task.step(*env.action.decode(action))
    np.testing.assert_array_equal(result.consumption, expected)


WEIGHTS = [field.name for field in fields(RewardWeights) if field.name != "band_bar"]
"""The prices."""
PRICES = RewardWeights(
    band=1.0, tracking=0.25, breakdown=0.25, switching=0.1, vented_air=2.0, failure=100.0
)
"""Of these tests: the defaults may be tuned."""
NOTHING = {
    "error_bar": 0.0,
    "highest_error_bar": 0.0,
    "lowest_error_bar": 0.0,
    "switchings": 0,
    "vented_kg": 0.0,
    "failed": False,
}


def terms(weights=PRICES, period=5e-3, **happened):
    """Terms of one period in which only what is named happened, as numbers."""
    values = {key: np.array([value]) for key, value in {**NOTHING, **happened}.items()}
    found = reward_terms(weights, period=period, **values)
    return {name: float(getattr(found, name)[0]) for name in RewardTerms._fields}


@pytest.mark.parametrize(
    ("happened", "expected"),
    [
        ({}, {}),
        ({"error_bar": 0.3}, {"tracking": -0.25 * 0.6}),
        ({"error_bar": -0.3}, {"tracking": -0.25 * 0.6}),
        ({"highest_error_bar": 0.5}, {}),
        ({"highest_error_bar": 0.51}, {"band": -1.0}),
        ({"lowest_error_bar": -0.5}, {"breakdown": -0.25}),
        ({"lowest_error_bar": -0.75}, {"band": -1.0, "breakdown": -0.375}),
        ({"highest_error_bar": -0.6, "lowest_error_bar": -0.7}, {"band": -1.0, "breakdown": -0.35}),
        ({"lowest_error_bar": 0.2, "highest_error_bar": 0.4}, {}),
        ({"switchings": 2}, {"switching": -0.2}),
        ({"vented_kg": 1.5e-3}, {"vented_air": -3.0}),
        ({"failed": True}, {"failure": -100.0}),
    ],
)
def test_each_event_has_its_price(happened, expected):
    assert terms(**happened) == pytest.approx({**dict.fromkeys(RewardTerms._fields, 0.0), **expected})


def test_running_terms_are_per_time_and_events_are_per_event():
    happened = {
        "error_bar": -0.6, "highest_error_bar": -0.5, "lowest_error_bar": -0.8,
        "switchings": 1, "vented_kg": 1e-3, "failed": True,
    }  # fmt: skip
    short, long = terms(period=5e-3, **happened), terms(period=20e-3, **happened)
    for name in RewardTerms._fields:
        factor = 4 if name in ("band", "tracking", "breakdown") else 1
        assert long[name] == pytest.approx(factor * short[name])
        assert short[name] < 0


@pytest.mark.parametrize("name", WEIGHTS)
def test_a_weight_scales_its_term_alone(name):
    happened = {"error_bar": -0.6, "lowest_error_bar": -0.8, "switchings": 1, "vented_kg": 1e-3}
    usual, double = (
        terms(replace(PRICES, **{name: factor * getattr(PRICES, name)}), failed=True, **happened)
        for factor in (1, 2)
    )
    assert double == pytest.approx({**usual, name: 2 * usual[name]})


@pytest.mark.parametrize("identifier", IDS)
def test_the_reward_is_the_sum_of_its_terms(identifier):
    found = run(native(identifier, 8, **ENDING), actions(identifier, 8, 40))
    seen = set()
    for step in found.steps:
        parts = {name: step.infos[f"reward_{name}"] for name in RewardTerms._fields}
        np.testing.assert_array_equal(sum(parts.values()), step.reward)
        assert all(np.all(part <= 0) for part in parts.values())
        seen |= {name for name, part in parts.items() if np.any(part < 0)}
    assert seen == set(RewardTerms._fields)
