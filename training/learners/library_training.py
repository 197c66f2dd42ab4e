"""Training of a library's algorithm on one of the environments as they are by default."""

import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat
from stable_baselines3.common.vec_env import VecMonitor

from epv_env.common.files import write_bytes
from epv_env.sb3 import make_sb3_env
from training.learners.checkpoint_selection import archive_of
from training.learners.library_algorithms import (
    NUM_ENVS,
    Algorithm,
    make_library_model,
)
from training.learners.run_folder import TENSORBOARD_FOLDER
from training.learners.training_env import seed_episodes

MODEL_FILE = "model.zip"
"""Within the folder of a training: the library's archive of the trained model."""


class Trained(NamedTuple):
    """A trained model and what it took."""

    model: BaseAlgorithm
    timesteps: int
    """Environment steps; whole rollouts, so perhaps a few more than were asked for."""
    cpu_s: float
    """Processor time of the training [s]."""


class _Steps(BaseCallback):
    """Tells how many steps each period of the batch adds."""

    def __init__(self, progress: Callable[[int], None]):
        super().__init__()
        self._progress = progress

    def _on_step(self) -> bool:
        self._progress(self.training_env.num_envs)
        return True


def train_library_algorithm(
    algorithm: Algorithm,
    environment: str,
    *,
    seed: int,
    timesteps: int,
    folder: Path,
    progress: Callable[[int], None] = lambda steps: None,
) -> Trained:
    """Train, and write the model into the folder. One thread, so that results do not depend on cores.

    Args:
        algorithm: what learns.
        environment: id; plant, scenario and all else are its defaults.
        seed: of the training. Others meet other episodes.
        timesteps: environment steps at least.
        folder: of the model and its TensorBoard events.
        progress: called with the number of new steps.

    Raises:
        ValueError: the seed is too large (training/evaluation/seeds.py).
    """
    torch.set_num_threads(1)
    shutil.rmtree(folder / TENSORBOARD_FOLDER, ignore_errors=True)  # of an interrupted attempt
    env = VecMonitor(make_sb3_env(environment, NUM_ENVS, threads=1))
    model = make_library_model(algorithm, env, seed=seed)
    seed_episodes(env, seed)  # the model has seeded them, too, and other trainings' alike
    events = TensorBoardOutputFormat(str(folder / TENSORBOARD_FOLDER))
    model.set_logger(Logger(folder=None, output_formats=[events]))
    begun = time.process_time()
    model.learn(timesteps, callback=_Steps(progress))
    cpu_s = time.process_time() - begun
    events.close()
    write_bytes(folder / MODEL_FILE, archive_of(model))
    return Trained(model, model.num_timesteps, cpu_s)
