"""PPO on the native vector environment: hyperparameters, model, training with selection and resume."""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper, VecMonitor
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from controllers.learned import GatedUnit, LearnedPolicy
from controllers.tuned import build, load_tunings
from epv_env.plant.plantfile import Plant
from epv_env.reward import BAND_BAR, RewardWeights
from epv_env.sb3 import make_sb3_env
from training.evaluation.seeds import RESUMED_SEED, training_seeds
from training.learners.checkpoint_selection import Selection, validation_points
from training.learners.entropy_schedule import FadingEntropy
from training.learners.imitation import imitate
from training.learners.learning_log import CHECKPOINT_FILE, CURVE_FILE, TrainingLog, read_rows
from training.learners.policy_files import greedy_policy, put_layers
from training.learners.recurrent_state_wrapper import RememberingEnv

TEACHER = "pulse"
"""Whom a model imitates first: on the calibrated plant the best of the controllers without a search."""


@dataclass(frozen=True, kw_only=True)
class Hyperparameters:
    """What defines the training; the rest is stable-baselines3's default."""

    num_envs: int = 256
    episode_steps: int = 600
    """Control periods of a training episode (3 s)."""
    n_steps: int = 64
    batch_size: int = 2048
    n_epochs: int = 3
    learning_rate: float = 7e-4
    """At the start; it falls linearly to `last_learning_rate`."""
    last_learning_rate: float = 2e-5
    reward_scale: float = 0.02
    """What the learner gets of a reward of 1, so that the critic's errors are about as large as the
    actor's advantages: PPO clips the gradients of both in common."""
    band_price: float = 6.0
    """Price of being outside the band in training, unless the reward's own is higher: leaving it is so
    rare for a good policy that at the reward's own price learning would hardly notice."""
    band_bar: float = BAND_BAR
    """Half-width of the band that is priced so, at most C1's; a narrower one keeps a margin [bar]."""
    breakdown_price: float = 0.0
    """Of the shortfall below the target in training, unless the reward's own is higher."""
    imitation_epochs: int = 8
    """Passes over the demonstration that the model imitates first (training/learners/imitation.py)."""
    sharpness: float = 1.0
    """Factor of the logits of a student to go on from: the larger, the less it explores."""
    gamma: float = 0.995
    gae_lambda: float = 0.95
    ent_coef: float = 0.003
    """At the start; it falls linearly to nothing, since the policy is used greedily."""
    width: int = 64
    """Of the two hidden layers."""
    validations: int = 8
    """How many of the policies are validated, evenly from `first_validation` to the end."""
    first_validation: float = 0.75
    """Share of the training before the first of them."""
    validation_episodes: int = 512
    validation_duration: float = 6.0
    """Length of a validation episode [s]."""


class ScaledReward(VecEnvWrapper):
    """Rewards times a constant; the monitor inside counts them as they are."""

    def __init__(self, env: VecMonitor, scale: float):
        super().__init__(env)
        self._scale = scale

    def reset(self) -> VecEnvObs:
        return self.venv.reset()

    def step_wait(self) -> VecEnvStepReturn:
        observation, reward, done, infos = self.venv.step_wait()
        return observation, self._scale * reward, done, infos


def make_training_env(
    h: Hyperparameters,
    *,
    plant: Plant,
    scenario: str,
    parameters: str,
    seed: int,
    weights: RewardWeights,
    cell: GatedUnit | None = None,
) -> VecEnvWrapper:
    """Episodes on plants drawn from a region, "confidence" or another (epv_env.settings).

    cell: a unit whose memory ends the observations (training/learners/recurrent_state_wrapper.py).
    Trainings with different seeds meet different episodes. Raises ValueError for a seed that is too
    large (training/evaluation/seeds.py).
    """
    env = make_sb3_env(
        "EPValve-v0",
        h.num_envs,
        max_episode_steps=h.episode_steps,
        plant=plant,
        parameters=parameters,
        scenario=scenario,
        weights=weights,
    )
    env.seed(training_seeds(seed, h.num_envs)[0])
    scaled = ScaledReward(VecMonitor(env), h.reward_scale)
    return RememberingEnv(scaled, cell) if cell else scaled


def make_model(h: Hyperparameters, env: VecEnv, *, seed: int, device: str) -> PPO:
    """A new PPO model."""
    first, last = h.learning_rate, h.last_learning_rate
    model = PPO(
        "MlpPolicy",
        env,
        n_steps=h.n_steps,
        batch_size=h.batch_size,
        n_epochs=h.n_epochs,
        learning_rate=lambda remaining: last + (first - last) * remaining,
        gamma=h.gamma,
        gae_lambda=h.gae_lambda,
        ent_coef=h.ent_coef,
        policy_kwargs={"net_arch": [h.width, h.width]},
        seed=seed,
        device=device,
    )
    model.set_logger(Logger(folder=None, output_formats=[]))  # its own leaves an empty folder in /tmp
    return model


def train(
    h: Hyperparameters,
    *,
    folder: Path,
    plant: Plant,
    scenario: str,
    parameters: str,
    weights: RewardWeights,
    timesteps: int,
    seed: int,
    device: str,
    resume: bool,
    student: LearnedPolicy | None = None,
    quiet: bool = False,
) -> tuple[LearnedPolicy, TrainingLog]:
    """Train until `timesteps` and return the best policy that was validated (checkpoint_selection.py).

    weights: prices of the reward; some are raised for the training (`Hyperparameters`).
    student: a policy to go on from; None: the model imitates the TEACHER first. What the student
    remembers with stays as it is.
    resume: go on from the folder's checkpoint. An interruption (Ctrl-C) leaves the newest checkpoint
    behind. A resumed run draws new episodes, so it is a continuation, not a repetition, of an
    uninterrupted one.
    """
    weights = replace(
        weights, band=max(weights.band, h.band_price), band_bar=min(weights.band_bar, h.band_bar),
        breakdown=max(weights.breakdown, h.breakdown_price),
    )  # fmt: skip
    torch.set_num_threads(1)  # sums do not depend on the machine's cores; the plant uses them all
    checkpoint = folder / CHECKPOINT_FILE
    done = 0
    task: dict[str, Any] = {
        "plant": plant,
        "parameters": parameters,
        "scenario": scenario,
        "weights": weights,
    }
    env = make_training_env(h, seed=seed, cell=student.cell if student else None, **task)
    model = make_model(h, env, seed=seed, device=device)
    if resume and checkpoint.exists():
        model.set_parameters(str(checkpoint), device=device)
        done = int(read_rows(folder / CURVE_FILE)[-1]["timesteps"])
        env.seed(RESUMED_SEED + seed * h.num_envs + done)
    elif h.imitation_epochs:
        example = student or build(TEACHER, load_tunings()[TEACHER].values, plant.parameters)
        if student:
            put_layers(model, student, h.sharpness)
        imitate(
            model, example, env, steps=h.episode_steps - 1, epochs=h.imitation_epochs, seed=seed,
            learn_actor=student is None,
        )  # fmt: skip
    greedy = partial(greedy_policy, student=student)
    selection = Selection(
        folder,
        points=validation_points(timesteps, first_share=h.first_validation, count=h.validations),
        episodes=h.validation_episodes,
        duration=h.validation_duration,
        options=task,
        controller=greedy,
    )
    log = TrainingLog(folder, timesteps, quiet=quiet)
    callbacks: list[BaseCallback] = [
        FadingEntropy(h.ent_coef, total=timesteps),
        selection,
        log,  # last: what it saves at the end has been validated
    ]
    if done < timesteps:
        model.num_timesteps = done
        try:
            model.learn(timesteps - done, callback=callbacks, reset_num_timesteps=done == 0)
        except KeyboardInterrupt:
            log.save()
            raise
    selection.restore_best(model)
    return greedy(model), log
