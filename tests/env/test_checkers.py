"""The public checkers accept both environments without a single warning."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

from tests.env.rollouts import IDS, actions, native

pytestmark = [pytest.mark.parametrize("identifier", IDS), pytest.mark.filterwarnings("error")]


def test_gymnasium_checker(identifier):
    check_env(gymnasium.make(identifier).unwrapped, skip_render_check=True)


@pytest.mark.training
def test_stable_baselines3_checker(identifier):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(gymnasium.make(identifier))


def test_gymnasium_s_passive_checker_accepts_a_whole_episode(identifier):
    """`make` wraps the passive checker around the environment."""
    env = gymnasium.make(identifier, max_episode_steps=50)
    assert "PassiveEnvChecker" in str(env)
    env.reset(seed=0)
    truncated = [env.step(command)[3] for command in actions(identifier, 1, 50)[:, 0]]
    assert truncated == [False] * 49 + [True]


def test_gymnasium_s_vector_wrappers_accept_the_batch(identifier):
    env = RecordEpisodeStatistics(NormalizeObservation(native(identifier, 3, max_episode_steps=10)))
    env.reset(seed=0)
    returns, infos = np.zeros(3), {}
    for command in actions(identifier, 3, 10):
        observation, reward, _, _, infos = env.step(command)
        returns += reward
        assert observation.shape == env.observation_space.shape
        assert np.all(np.isfinite(observation))
    np.testing.assert_allclose(infos["episode"]["r"], returns, rtol=1e-6)
    np.testing.assert_array_equal(infos["episode"]["l"], 10)
