"""Effects, moving targets, recorded consumption, weights by name, and the truth for critics."""

import gymnasium
import numpy as np
import pytest

import epv_env  # noqa: F401 - registers the ids
from epv_env.env import EPValveEnv
from epv_env.observation import decode
from epv_env.result import PARAMETER_NAMES, STATE_NAMES
from epv_env.signals import MovingTarget, RecordedConsumption
from epv_env.vector_env import EPValveVectorEnv

CALM = {"scenario": "none", "supply": 12.0, "p2_bar": 8.0, "target_bar": 8.0}


def single(**options) -> EPValveEnv:
    env = gymnasium.make("EPValve-v0", **{**CALM, **options}).unwrapped
    assert isinstance(env, EPValveEnv)
    return env


def column(env, symbol):
    return env.task.parameter_values[:, PARAMETER_NAMES.index(symbol)]


def test_effects_are_drawn_anew_for_every_episode_and_replaced_for_one():
    env = single(effects={"eddy_current": (0.001, 0.004), "command_delay": 0.002})
    found = []
    for seed in range(20):
        env.reset(seed=seed)
        found.append(column(env, "G_eddy")[0])
        assert column(env, "t_delay")[0] == 0.002
    assert len(set(found)) == 20
    assert 0.001 <= min(found) < max(found) <= 0.004
    env.reset(seed=0, options={"effects": {"command_delay": 0.003}})
    assert (column(env, "G_eddy")[0], column(env, "t_delay")[0]) == (0.0, 0.003)
    env.reset(seed=0, options={"parameters": {"R": 45.0}})
    assert (column(env, "G_eddy")[0], column(env, "R")[0]) == (found[0], 45.0)


def test_each_sub_environment_may_have_a_length_of_its_own():
    lengths = [2, 3, 5]
    env = gymnasium.make_vec(
        "EPValve-v0", num_envs=3, max_episode_steps=lengths, autoreset_mode="SameStep"
    )
    env.reset(seed=0)
    ends = np.array([env.step(np.ones(3, dtype=int))[3] for _ in range(30)])
    assert ends.sum(axis=0).tolist() == [15, 10, 6]
    with pytest.raises(ValueError, match="lists 2 numbers for 3 environments"):
        gymnasium.make_vec("EPValve-v0", num_envs=3, max_episode_steps=[2, 3])


@pytest.mark.parametrize(
    "samples", [([0, 1], [1]), ([1, 0], [1, 1]), ([0, np.nan], [1, 1]), ([], []), (["a"], [1])]
)
def test_signals_need_increasing_times_and_finite_values(samples):
    for make in (RecordedConsumption.from_samples, MovingTarget.recorded):
        with pytest.raises(ValueError, match=r"^a recorded "):
            make(*samples)


def test_a_moving_target_is_what_observation_and_reward_refer_to():
    env = single(target_bar=MovingTarget.recorded([0.0, 1.0], [8.0, 9.0]), sensor_noise=0.0)
    observation, _ = env.reset(seed=0)
    assert decode(observation, "target") == pytest.approx(8.0)
    for k in range(1, 100):
        observation, *_, info = env.step(1)
        target = 8.0 + 0.005 * k
        assert decode(observation, "target") == pytest.approx(target, abs=1e-6)
        p2 = env.snapshot().p2_bar
        assert info["reward_tracking"] == pytest.approx(-0.25 * abs(p2 - target) / 0.5)


def test_a_recorded_consumption_is_drawn_as_it_was_measured():
    """Triangles: the mean over a period is exact, also over a kink, and the ends hold."""
    recorded = RecordedConsumption.from_samples([0.0, 0.0125, 0.1], [1.0, 3.0, 2.0])
    env = single(scenario=recorded)
    env.reset(seed=0)
    fine = np.linspace(0.0, 0.15, 30 * 2000 + 1)
    flow = np.interp(fine, [0.0, 0.0125, 0.1], [1.0, 3.0, 2.0])
    for k in range(30):
        part = flow[2000 * k : 2000 * (k + 1) + 1]
        mean = (part[1:] + part[:-1]).mean() / 2
        assert env.step(1)[-1]["consumption_g_per_s"] == pytest.approx(mean, rel=1e-6)


def test_the_truth_belongs_to_the_observation_shown():
    for mode in ("NextStep", "SameStep"):
        env = gymnasium.make_vec(
            "EPValve-v0", num_envs=2, max_episode_steps=3, autoreset_mode=mode, privileged=True,
            parameters="ten_percent",
        ).unwrapped  # fmt: skip
        assert isinstance(env, EPValveVectorEnv)
        assert env.autoreset_mode.value == mode
        _, before = env.reset(seed=0)
        infos = {}
        for _ in range(3):
            *_, infos = env.step(np.ones(2, dtype=int))
        if mode == "NextStep":
            *_, infos = env.step(np.ones(2, dtype=int))
        else:
            assert np.array_equal(infos["final_info"]["true_state"].shape, (2, len(STATE_NAMES)))
        assert np.array_equal(infos["true_state"].T, np.stack(env.task.valves.state))
        assert not np.array_equal(infos["parameters"], before["parameters"])
