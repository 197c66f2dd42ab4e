"""Training and evaluation on a device, which numba's simulator stands for, in processes of their own."""

import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
from controllers.hysteresis import Hysteresis
from controllers.pulse_table import nominal_table
from epv_env.plant.plantfile import Plant
from training.evaluation.batches import Batch, _run, in_batches
from training.learners.environment import make_training_env
from training.learners.ppo import Task

pytestmark = [pytest.mark.training, pytest.mark.slow]
TASK = Task(plant=Plant.calibrated())
CONTROLLER = Hysteresis(open_below=0.0, shut_above=0.0)


def batch(device: str) -> Batch:
    """Two short episodes without noise, in worn valves."""
    conditions = {"worn": 1.0, "delayed": 1.0}
    options = {"sensor_noise": 0.0, "settling_time": 0.0, "conditions": conditions}
    return Batch(
        name="", controller="", first_seed=3, episodes=2, duration=0.06, options=options, device=device
    )


TRAIN = """
import pickle, sys
import numpy as np
from controllers import knowledge, valve_learner
from training.learners import ppo
from tests.training.test_device import TASK, make_training_env

table, file = pickle.load(open(sys.argv[1], "rb")), sys.argv[2]
# The simulator wants plain Python: tables are made by compiled code, and records need attributes.
knowledge.nominal_table = lambda plant: table
valve_learner.VALVE = np.dtype((np.record, valve_learner.VALVE))
env = make_training_env(num_envs=2, device="cuda", **vars(TASK))
ppo.PPO_SETTINGS["n_steps"] = 2
model = ppo.make_model(env, seed=0, device="cuda")
env.seed(7)
model.learn(4)
assert model.num_timesteps == 4
buffer = model.rollout_buffer
env.seed(7)
np.savez(file, first=env.reset(), later=buffer.observations, rewards=buffer.rewards)
"""
EVALUATE = """
import pickle, sys
from tests.training.test_device import CONTROLLER, _run, batch

pickle.dump(_run(batch("cuda"), CONTROLLER)[1], open(sys.argv[1], "wb"))
"""


def simulate(code: str, *paths: Path) -> None:
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"}
    subprocess.run([sys.executable, "-c", code, *paths], env=environment, check=True, timeout=600)


def test_ppo_trains_on_a_simulated_device(tmp_path: Path):
    """Episodes begin as on the CPU; torch itself is on the host where there is no accelerator."""
    table, file = tmp_path / "table", tmp_path / "found.npz"
    table.write_bytes(pickle.dumps(nominal_table(TASK.plant)))
    simulate(TRAIN, table, file)
    found, env = np.load(file), make_training_env(num_envs=2, **vars(TASK))
    env.seed(7)
    first = np.asarray(env.reset())
    np.testing.assert_allclose(found["first"], first, atol=1e-5)
    assert np.ptp(found["later"], axis=0).max() > 0.0
    assert np.all(found["rewards"] < 0.0)


def test_a_batch_on_a_simulated_device_gives_the_figures_of_the_cpu(tmp_path: Path):
    file = tmp_path / "figures"
    simulate(EVALUATE, file)
    figures = pickle.loads(file.read_bytes())
    for name, expected in _run(batch("cpu"), CONTROLLER)[1].items():
        np.testing.assert_allclose(figures[name], expected, atol=1e-6, err_msg=name)


def test_batches_of_a_device_are_larger_and_have_names_of_their_own():
    parts, others = (in_batches(replace(batch(d), episodes=9000)) for d in ("cuda", "cpu"))
    assert len(parts) == 2 < len(others)
    assert not {part.name for part in parts} & {part.name for part in others}
