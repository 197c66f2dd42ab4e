"""The native batch as a stable-baselines3 VecEnv: infos, seeds, attributes, training."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from tests.env.rollouts import ENDING, IDS, actions, native

sb3 = pytest.importorskip("stable_baselines3")
vec_env = pytest.importorskip("stable_baselines3.common.vec_env")
from epv_env.sb3 import SB3VectorEnv, make_sb3_env  # noqa: E402 - needs the import above

pytestmark = pytest.mark.training
CALM = {"scenario": "none", "supply": 10.0, "target_bar": 8.0, "p2_bar": 8.0}


def batch(identifier, n, **options) -> Any:
    """The native batch."""
    return make_sb3_env(identifier, n, **options)


def dummy(identifier, n, **options) -> Any:
    """The same as single environments under stable-baselines3's own DummyVecEnv."""
    return vec_env.DummyVecEnv([lambda: gymnasium.make(identifier, **options)] * n)


@pytest.mark.parametrize("identifier", IDS)
def test_it_equals_dummy_vec_env(identifier):
    n, options = 5, {**ENDING, "max_episode_steps": 12}
    ours, theirs = batch(identifier, n, **options), dummy(identifier, n, **options)
    ours.seed(4)
    theirs.seed(4)
    np.testing.assert_array_equal(ours.reset(), theirs.reset())
    ended = np.zeros(n)
    for command in actions(identifier, n, 60):
        found, expected = ours.step(command), theirs.step(command)
        for a, b in zip(found[:3], expected[:3], strict=True):
            np.testing.assert_array_equal(a, b)
            assert a.dtype == b.dtype
        for i in np.flatnonzero(found[2]):
            info, other = found[3][i], expected[3][i]
            np.testing.assert_array_equal(
                info.pop("terminal_observation"), other.pop("terminal_observation")
            )
            assert info == other
            ended[i] += 1
    assert np.all(ended > 1)


def test_a_truncated_episode_tells_its_end():
    env = batch("EPValve-v0", 2, max_episode_steps=110, **CALM)
    env.seed(0)
    env.reset()
    on = np.array([1, 0])
    for _ in range(109):
        _, _, done, infos = env.step(on)
        assert not done.any()
        assert infos == [{}, {}]
    observation, _, done, infos = env.step(on)
    assert done.all()
    assert [info["TimeLimit.truncated"] for info in infos] == [True, True]
    assert [bool(info["is_success"]) for info in infos] == [True, False]
    for i, info in enumerate(infos):
        assert env.observation_space.contains(info["terminal_observation"])
        assert np.any(info["terminal_observation"] != observation[i])
    assert env.step(on)[3] == [{}, {}]


def test_seeds_and_options_are_forwarded():
    env = batch("EPValve-v0", 3)
    assert list(env.seed(7)) == [7, 8, 9]
    expected, _ = native("EPValve-v0", 3).reset(seed=7)
    np.testing.assert_array_equal(env.reset(), expected)
    assert np.any(env.reset() != expected)  # a seed is used once
    env.set_options([{"target_bar": 7.0}, {"target_bar": (8.0, 8.1)}, {}])
    env.reset()
    assert 7.0 == env.env.task.target[0] < 8.0 <= env.env.task.target[1] <= 8.1


def test_attributes_and_methods_are_reached():
    env = batch("EPValve-v0", 3)
    assert env.get_attr("max_episode_steps") == [2000] * 3
    assert env.get_attr("num_envs", indices=[0, 2]) == [3, 3]
    env.set_attr("max_episode_steps", 5)
    assert env.get_attr("max_episode_steps", 1) == [5]
    env.reset()
    done = [env.step(np.ones(3, dtype=int))[2] for _ in range(5)]
    np.testing.assert_array_equal(done, [[False] * 3] * 4 + [[True] * 3])
    assert len(env.env_method("reset", seed=3)) == 3
    assert env.env_is_wrapped(gymnasium.wrappers.TimeLimit) == [False] * 3


@pytest.mark.parametrize("mode", ["NextStep", "Disabled"])
def test_another_autoreset_mode_is_refused(mode):
    with pytest.raises(ValueError, match=r'needs autoreset in the same step: .*"SameStep"'):
        SB3VectorEnv(native("EPValve-v0", 2, autoreset_mode=mode))


@pytest.mark.parametrize("identifier", IDS)
def test_ppo_learns_from_two_rollouts(identifier):
    env = vec_env.VecMonitor(batch(identifier, 8, max_episode_steps=20))
    model = sb3.PPO("MlpPolicy", env, n_steps=32, batch_size=64, n_epochs=1, seed=0, device="cpu")
    model.learn(2 * 8 * 32)
    assert model.num_timesteps == 512
    assert len(model.ep_success_buffer) > 0
    action, _ = model.predict(env.reset(), deterministic=True)
    assert env.get_attr("action_space")[0].contains(action)


PROCESSES = """
import numpy as np
from stable_baselines3.common.vec_env import SubprocVecEnv
from tests.env.rollouts import actions, native, run

def make():
    import gymnasium
    return gymnasium.make("epv_env:EPValve-v0")

if __name__ == "__main__":
    run(native("EPValve-v0", 256, threads=2), actions("EPValve-v0", 256, 3))  # threads run from here on
    for method in ("fork", "spawn"):
        worker, here = SubprocVecEnv([make], start_method=method), native("EPValve-v0", 1)
        worker.seed(3)
        same = np.array_equal(worker.reset(), here.reset(seed=3)[0])
        for command in actions("EPValve-v0", 1, 5):
            same &= np.array_equal(worker.step(command)[0], here.step(command)[0])
        worker.close()
        print(method, bool(same))
"""


def test_worker_processes_agree_with_a_parent_that_has_threads(tmp_path):
    script = tmp_path / "processes.py"
    script.write_text(PROCESSES)
    root = str(Path(__file__).parents[2])
    done = subprocess.run(
        [sys.executable, script], env={**os.environ, "PYTHONPATH": root},
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.stdout.split("\n")[:2] == ["fork True", "spawn True"], done.stderr
