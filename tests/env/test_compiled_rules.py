"""The compiled step applies the rules that NumPy callers use, to the bit."""

import numpy as np
import pytest

from epv_env.common.units import BAR
from epv_env.observation import INDEX, encode
from epv_env.plant.channels import MEASURED, SENSORS, readings
from epv_env.reward import RewardTerms, reward_terms, total
from tests.env.rollouts import IDS, actions, native

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
