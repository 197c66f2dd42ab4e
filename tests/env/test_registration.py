"""The ids work after `import epv_env`, and as "epv_env:ID" without it, from anywhere."""

import subprocess
import sys
from typing import Any

import gymnasium
import pytest

from epv_env.env import EPValveEnv, EPValvePWMEnv
from epv_env.vector_env import EPValvePWMVectorEnv, EPValveVectorEnv
from tests.env.rollouts import IDS, native

CLASSES = {
    "EPValve-v0": (EPValveEnv, EPValveVectorEnv),
    "EPValvePWM-v0": (EPValvePWMEnv, EPValvePWMVectorEnv),
}


def run_abroad(code: str, folder) -> str:
    """What a fresh interpreter prints that starts in a folder of its own."""
    done = subprocess.run(
        [sys.executable, "-W", "error::UserWarning", "-c", code],
        cwd=folder, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("identifier", IDS)
def test_an_id_makes_its_classes_for_episodes_of_ten_seconds(identifier):
    single, vector = CLASSES[identifier]
    env: Any = gymnasium.make(identifier)
    assert type(env.unwrapped) is single
    assert type(gymnasium.make_vec(identifier, num_envs=2)) is vector
    assert env.spec.max_episode_steps * env.unwrapped.settings.control_period == 10.0
    assert native(identifier, 1).max_episode_steps == env.spec.max_episode_steps


def test_ids_work_from_a_foreign_folder_without_an_import(tmp_path):
    code = """
import gymnasium
for name in ("EPValve-v0", "EPValvePWM-v0"):
    env = gymnasium.make("epv_env:" + name)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    envs = gymnasium.make_vec("epv_env:" + name, num_envs=2)
    envs.reset(seed=0)
    print(envs.step(envs.action_space.sample())[0].shape)
"""
    assert run_abroad(code, tmp_path) == "(2, 13)\n(2, 13)\n"
