"""PPO on the native vector environment: model, imitation, training with selection and resume."""

import hashlib
import io
import pickle
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from controllers.learned import LearnedPolicy
from controllers.supervised import supervised
from controllers.tuned import build, load_tunings
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from training.learners.batch_ppo import BatchPPO
from training.learners.checkpoint_selection import Selection, validation_points
from training.learners.hyperparameters import Hyperparameters, training_weights
from training.learners.imitation import imitate
from training.learners.learning_log import TrainingLog
from training.learners.policy_files import greedy_policy, policy_bytes, put_layers, put_student
from training.learners.provenance import plant_digest
from training.learners.recurrent_actor_critic import RecurrentActorCritic
from training.learners.resumption import restore_progress
from training.learners.run_folder import TENSORBOARD_FOLDER
from training.learners.run_state import (
    CHECKPOINT_FILE,
    Run,
    RunError,
    as_json,
    new_run,
    unfinished_run,
    with_nan,
)
from training.learners.schedules import FadingEntropy, linear
from training.learners.sequence_ppo import SequencePPO
from training.learners.student import END_TO_END_NAME
from training.learners.training_env import make_training_env, seed_episodes
from training.learners.validation import ValidationSettings

TEACHER = "pulse"
"""Controller that a model imitates first: the best that does not simulate, on the calibrated plant."""


FUSED_ADAM = {"fused": True, "eps": 1e-5}
"""stable-baselines3's settings of Adam, its update in one kernel."""


def make_model(
    h: Hyperparameters, env: VecEnv, *, seed: int, device: str, cells: int | None = None
) -> PPO:
    """A new PPO model. device: of torch. cells: of a recurrent unit that learns; None: it has none."""
    kind: Any = BatchPPO
    own: dict[str, Any] = {"policy": "MlpPolicy"}
    policy: dict[str, Any] = {"net_arch": [h.width, h.width]}
    if cells is not None:
        kind = SequencePPO
        own = {
            "policy": RecurrentActorCritic, "critic_rate": h.critic_rate, "critic_first": h.critic_first,
            "restarts": h.restarts,
        }  # fmt: skip
        policy = {
            "memory": cells, "width": h.width, "critic_width": h.critic_width, "averaging": h.averaging,
        }  # fmt: skip
    model: PPO = kind(
        env=env,
        n_steps=h.n_steps,
        batch_size=h.batch_size,
        n_epochs=h.n_epochs,
        learning_rate=partial(linear, h.learning_rate, h.last_learning_rate),
        gamma=h.gamma,
        gae_lambda=h.gae_lambda,
        ent_coef=h.ent_coef,
        clip_range=h.clip_range,
        policy_kwargs={**policy, "optimizer_kwargs": FUSED_ADAM},
        seed=seed,
        device=device,
        **own,
    )
    model.set_logger(Logger(folder=None, output_formats=[]))  # its own leaves an empty folder in /tmp
    seed_episodes(env, seed)  # the model has seeded them, too, and other trainings' alike
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
    run: str | None = None,
    quiet: bool = False,
) -> tuple[LearnedPolicy, TrainingLog]:
    """Train until `timesteps` and return the best validated policy (checkpoint_selection.py).

    An interruption leaves the newest checkpoint behind. A run that is resumed from it gives, to the bit,
    the policy of an uninterrupted one (on the same machine, and device "cpu").

    Raises RunError if the folder's checkpoint is of another run or subject, or damaged.

    Args:
        h: hyperparameters.
        folder: of checkpoint, learning curve and validations.
        plant: centre of the region.
        scenario: of the consumption.
        parameters: region that plants are drawn from.
        weights: prices of the reward; some are raised for the training (`Hyperparameters`).
        timesteps: environment steps in all.
        seed: of the training.
        device: of torch.
        resume: whether to go on from the folder's checkpoint.
        student: a policy to go on from; its recurrent unit learns if `h.end_to_end`, or stays as it is.
            None: the model imitates the TEACHER first.
        run: identity of the run; None: that of the folder's checkpoint, or a new one.
        quiet: no progress bar.
    """
    subject = _subject(
        h, plant, student, seed=seed, scenario=scenario, parameters=parameters, weights=asdict(weights)
    )
    found = unfinished_run(folder, subject, run) if resume else None
    begun = found.run if found else Run(run=run or new_run(), subject=as_json(subject))
    done = begun.timesteps
    torch.set_num_threads(1)  # sums do not depend on the machine's cores; the plant uses them all
    task: dict[str, Any] = {
        "plant": plant, "parameters": parameters, "scenario": scenario,
        "weights": training_weights(weights, h),
    }  # fmt: skip
    learns = student if h.end_to_end else None  # whose recurrent unit learns
    shown = student.cell if student and not learns else None
    env = make_training_env(h, seed=seed, cell=shown, privileged=learns is not None, **task)
    model = make_model(h, env, seed=seed, device=device, cells=learns.cells if learns else None)
    if found:
        _restore(model, folder / CHECKPOINT_FILE, device=device)
        restore_progress(model, found.progress)
    elif learns:
        put_student(model, learns, h.sharpness)
    elif h.imitation_epochs:
        _start(model, h, env, plant, student=student, seed=seed)
    greedy = partial(greedy_policy, student=student)
    selection = Selection(
        points=validation_points(timesteps, first_share=h.first_validation, count=h.validations),
        settings=ValidationSettings(episodes=h.validation_episodes, duration=h.validation_duration),
        options={**task, "conditions": h.validation_conditions},
        controller=lambda model: supervised(greedy(model), plant) if learns else greedy(model),
        rows=with_nan(begun.validations),
        best=found.best if found else None,
    )
    log = TrainingLog(folder, begun, selection, total=timesteps, quiet=quiet)
    callbacks: list[BaseCallback] = [
        FadingEntropy(h.ent_coef, total=timesteps),
        selection,
        log,  # last: what it saves at the end has been validated
    ]
    if done < timesteps:
        model.num_timesteps = done
        events = TensorBoardOutputFormat(str(folder / TENSORBOARD_FOLDER))
        model.set_logger(Logger(folder=None, output_formats=[events]))
        model.learn(timesteps - done, callback=callbacks, reset_num_timesteps=found is None)
        events.close()
    if selection.best is None:
        raise RunError(
            f"the run in {folder} has done {done} steps, and none of its policies is validated yet: "
            f"resume it with more than {timesteps} steps"
        )
    best_model: Any = io.BytesIO(selection.best)  # stable-baselines3 takes streams, too
    model.set_parameters(best_model, device=device)
    policy = greedy(model)
    return (replace(policy, name=END_TO_END_NAME) if learns else policy), log


def _restore(model: PPO, checkpoint: Path, *, device: str) -> None:
    """Give the model a checkpoint's parameters. Raises RunError if they are another network's."""
    try:
        model.set_parameters(str(checkpoint), device=device)
    except (ValueError, RuntimeError, KeyError, pickle.UnpicklingError) as error:
        raise RunError(
            f"{checkpoint} does not fit this training's networks ({error}): give --force to begin anew, "
            "or choose another --out"
        ) from None


def _subject(
    h: Hyperparameters, plant: Plant, student: LearnedPolicy | None, **options: Any
) -> dict[str, Any]:
    """All that a training depends on but its length, ready for JSON."""
    return {
        **options, "hyperparameters": asdict(h), "plant": plant_digest(plant),
        "student": hashlib.sha256(policy_bytes(student)).hexdigest() if student else None,
    }  # fmt: skip


def _start(
    model: PPO,
    h: Hyperparameters,
    env: VecEnvWrapper,
    plant: Plant,
    *,
    student: LearnedPolicy | None,
    seed: int,
) -> None:
    """Start from a student, whose returns the critic learns, or from an imitation of the TEACHER."""
    teacher = student or build(TEACHER, load_tunings()[TEACHER].values, plant)
    if student:
        put_layers(model, student, h.sharpness)
    imitate(
        model, teacher, env, steps=h.episode_steps - 1, epochs=h.imitation_epochs, seed=seed,
        learn_actor=student is None,
    )  # fmt: skip
