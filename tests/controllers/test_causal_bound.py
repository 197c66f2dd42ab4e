"""The causal bound foresees what may happen and not what will, and disturbs nothing."""

import numpy as np
import pytest

from controllers.causal_bound import CausalBound
from controllers.likely_consumption import likely_flows, scenario_of
from controllers.privileged_pulse import PrivilegedPulse
from epv_env.plant.consumption import SCENARIOS, Profiles, Scenario
from epv_env.vector_env import EPValveVectorEnv
from training.evaluation.rollout import run_episodes

PERIOD = 5e-3


def profiles(scenario, count=1):
    found = Profiles(count)
    for i in range(count):
        found.start(i, scenario.draw(np.random.default_rng(i)))
    return found


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_scenario_is_recognised(name):
    assert all(
        scenario_of(record) == SCENARIOS[name] for record in profiles(SCENARIOS[name], 5).progress
    )


def test_an_unknown_consumption_is_refused():
    record = profiles(Scenario(meaning="hard", flow=(8.0, 8.0), hold=(1.0, 1.0))).progress[0]
    with pytest.raises(ValueError, match="none of the named scenarios"):
        scenario_of(record)


@pytest.mark.parametrize("name", SCENARIOS)
def test_what_may_follow_begins_where_things_stand_and_then_differs(name):
    """The flow of the next period is the true one, unless something begins or ends."""
    found, rng = profiles(SCENARIOS[name]), np.random.default_rng(1)
    near, mean = [], []
    for step in range(800):
        time = step * PERIOD
        true = found.mean_flow(np.array([time]), PERIOD)[0]
        drawn = likely_flows(
            found.progress[0], SCENARIOS[name], time=time, period=PERIOD, periods=40, draws=4, rng=rng
        )
        assert np.all(drawn > -1e-12)
        near.append(np.mean(np.abs(drawn[:, 0] - true) < 1e-5))
        mean.append(np.ptp(drawn.mean(axis=1)))
    assert np.mean(near) > 0.9
    if name not in ("none", "leak"):
        assert np.max(mean) > 1e-4  # the draws part


def test_it_costs_less_than_the_pulse_controller_that_knows_its_plant():
    options = {"parameters": "sensitive_ten_percent", "scenario": "steps", "threads": 1}
    returns = [
        run_episodes(controller, seeds=[70, 71, 72], duration=1.5, options=options)[0].episode_return
        for controller in (CausalBound(draws=4, horizon=60), PrivilegedPulse())
    ]
    assert returns[0].mean() > returns[1].mean()


def test_it_does_not_disturb_what_it_watches():
    rewards = []
    for watched in (True, False):
        env = EPValveVectorEnv(2, autoreset_mode="Disabled", threads=1, scenario="service")
        observation, _ = env.reset(seed=3)
        bound = CausalBound(draws=2, horizon=20)
        bound.watch(env.task)
        for step in range(20):
            if watched:
                bound.act(observation)
            reward = env.task.step(*env.action.decode(np.full(2, step % 3 > 0))).reward
            rewards.append(reward.copy())
    np.testing.assert_array_equal(rewards[:20], rewards[20:])


@pytest.mark.parametrize("delay", [0.0, 8e-3])
def test_a_trial_of_one_period_ends_where_the_plant_does(delay):
    """Even while the coil still has its former voltage."""
    effects = {"command_delay": {"t_delay": delay}} if delay else None
    env = EPValveVectorEnv(1, autoreset_mode="Disabled", threads=1, scenario="none", effects=effects)
    observation, _ = env.reset(seed=3)
    bound = CausalBound(draws=1, horizon=1)
    bound.watch(env.task)
    for action in (0, 0, 0, 0, 1, 1, 1):
        bound.act(observation)
        env.task.step(*env.action.decode(np.array([action])))
        assert bound._valves.state.p3[action] == env.task.valves.state.p3[0]
        assert bound._valves.state.I[action] == env.task.valves.state.I[0]


def test_it_has_to_watch():
    with pytest.raises(ValueError, match="call watch"):
        CausalBound().act(np.zeros((1, 13)))
