"""Training with stable-baselines3's PPO: the model, the choice of the best policy, and resumption."""

from dataclasses import dataclass, field
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch
from safetensors import SafetensorError
from safetensors.torch import load, save
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.utils import set_random_seed
from stable_baselines3.common.vec_env import VecEnv
from tqdm import tqdm

from controllers.policy import Policy
from controllers.policy_files import read_policy, write_policy
from epv_env.actions import OnOff
from epv_env.common.files import read_bytes, write_bytes, write_text
from epv_env.conditions import Conditions
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Mixture, Region
from epv_env.reward import RewardWeights
from training.evaluation.metrics import EpisodeMetrics
from training.evaluation.rollout import run_episodes
from training.evaluation.seeds import VALIDATION_SEED, first_training_seed
from training.learners.actor import AdvisedPolicy, network_of
from training.learners.environment import NUM_ENVS, ROLLOUT, make_training_env

LEARNING_RATE, LAST_LEARNING_RATE = 3e-3, 2e-5
"""Adam's step size at the start and at the end; it falls linearly. With smaller ones a training ends
before it has converged, and its policy switches more often."""
ENTROPY = 0.003
"""Entropy coefficient at the start; it falls linearly to zero, since the policy is used greedily."""
BATCH = 4096
"""Transitions of a gradient step."""
PPO_SETTINGS: dict[str, Any] = {
    "n_steps": ROLLOUT,
    "n_epochs": 2,  # the second pass costs a sixth of the time, and training converges sooner
    "gamma": 0.998,
    "policy_kwargs": {
        "net_arch": {"pi": [64, 64], "vf": [64, 64]},
        "optimizer_kwargs": {"fused": True, "eps": 1e-5},
    },
}
"""Of stable-baselines3's PPO; the rest is its default."""

FIRST_VALIDATION = 0.8
"""Share of the training before the first validation."""
VALIDATIONS = 3
"""Policies that are validated, evenly from there to the end."""
VALIDATION_DURATION = 6.0
"""Length of a validation episode [s]."""
VALIDATION_CONDITIONS = Conditions(extreme=0.5, braking=0.5)
"""Plants from the region's corners and hard applications are frequent in validation."""
VIOLATION_PRICE = 300.0
"""Loss of score by an episode that leaves the band, beside its return: somewhat more than a good episode
loses in all. Violations are rare, so the mean return would hardly show one."""

CHECKPOINTS = "checkpoints"
"""Folder of the checkpoints, within that of the training: arrays, of which none is a program."""
ADAM = ("step", "exp_avg", "exp_avg_sq")
"""What the optimiser keeps of each weight: the number of its steps, and two moments of its shape."""
LARGEST = 10**9
"""Magnitude, and number of steps, beyond which a checkpoint is none."""
BEST = "best"
"""Folder of the best validated policy, within that of the training."""
VALIDATION_FILE = "validation.csv"
ROW = (
    "timesteps", "score", "episodes", "left", "mean_return", "rms_error_bar", "switchings_per_s"
)  # fmt: skip
"""Its columns."""
CHECKPOINT_STEPS = 1_000_000
"""Environment steps between two checkpoints. New episodes begin with each, so a training that is resumed
there meets the same ones as an uninterrupted one."""


def linear(first: float, last: float, remaining: float) -> float:
    """The value between `first` and `last` when the share `remaining` of a training lies ahead [1].

    stable-baselines3's LinearSchedule rounds otherwise, so that a seed would give another policy.
    """
    return last + (first - last) * remaining


def make_model(env: VecEnv, *, seed: int, policy: str | type[ActorCriticPolicy] = AdvisedPolicy) -> PPO:
    """A new model; with the usual policy it begins as the adaptive pulse with some exploration."""
    return PPO(
        policy,
        env,
        learning_rate=partial(linear, LEARNING_RATE, LAST_LEARNING_RATE),
        ent_coef=ENTROPY,
        batch_size=min(BATCH, ROLLOUT * env.num_envs),
        seed=seed,
        device="cpu",
        **PPO_SETTINGS,
    )


@dataclass(frozen=True, kw_only=True)
class Task:
    """What a policy is trained for, and validated on."""

    plant: Plant
    """Centre of the region."""
    scenario: str = "mixed"
    """Of the consumption."""
    parameters: str | Region | Mixture = "sensitive_ten_percent"
    """Region that plants are drawn from, or its name."""
    weights: RewardWeights = field(default_factory=RewardWeights)
    """Prices of the reward; some are raised for the training."""


def score(metrics: EpisodeMetrics) -> float:
    """How good a policy is: its mean return less the price of its violations."""
    return float(metrics.episode_return.mean() - VIOLATION_PRICE * (~metrics.stayed).mean())


class Course(BaseCallback):
    """What happens between rollouts: less entropy, validations, checkpoints, and the bar.

    The policy that validates best is kept in a folder, as `score` judges the greedy one.
    stable-baselines3's EvalCallback knows the mean return alone, and its CheckpointCallback saves amid a
    rollout, from where a training does not go on to the same policy.
    """

    def __init__(
        self, task: Task, folder: Path, bar: tqdm, *, total: int, seed: int, episodes: int,
        duration: float, provenance: dict[str, Any],
    ):  # fmt: skip
        super().__init__()
        self._task, self._folder, self._bar = task, folder, bar
        self._total, self._seed, self._provenance = total, seed, provenance
        seeds = list(range(VALIDATION_SEED, VALIDATION_SEED + episodes))
        options = {**vars(task), "conditions": VALIDATION_CONDITIONS}
        self._validation: dict[str, Any] = {"seeds": seeds, "duration": duration, "options": options}
        self._points = [
            round(share * total) for share in np.linspace(FIRST_VALIDATION, 1.0, VALIDATIONS)
        ]

    def _on_training_start(self) -> None:
        """Forget what was validated after the checkpoint that the training goes on from."""
        (self._folder / CHECKPOINTS).mkdir(parents=True, exist_ok=True)
        self._checked = self._saved = self.num_timesteps
        self._rows = [r for r in read_rows(self._folder) if r["timesteps"] <= self.num_timesteps]

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        assert isinstance(self.model, PPO)
        self.model.ent_coef = ENTROPY * max(1 - self.num_timesteps / self._total, 0.0)
        self._validate_if_due()
        if self.num_timesteps >= self._saved + CHECKPOINT_STEPS:
            self._saved = self.num_timesteps
            save_checkpoint(self.model, self._folder)
            seed_episodes(self.model, self._seed)
            self.model._last_obs = self.training_env.reset()  # type: ignore[assignment]
            self.model._last_episode_starts = np.ones(self.training_env.num_envs, dtype=bool)

    def _on_rollout_end(self) -> None:
        """The bar shows the share of episodes that stay within the band while the policy explores."""
        self._bar.update(min(self.num_timesteps, self._total) - self._bar.n)
        if self.model.ep_success_buffer:
            self._bar.set_postfix(stayed=f"{np.mean(self.model.ep_success_buffer):.0%}")

    def _on_training_end(self) -> None:
        self._validate_if_due()

    def _validate_if_due(self) -> None:
        """Validate once for all points that have been passed since the last time."""
        due = any(self._checked < point <= self.num_timesteps for point in self._points)
        self._checked = self.num_timesteps
        if not due:
            return
        assert isinstance(self.model, PPO)
        network = network_of(self.model)
        policy = Policy(network=network, plant=self._task.plant)
        metrics = run_episodes(policy, **self._validation)
        row = {
            "timesteps": float(self.num_timesteps),
            "score": score(metrics),
            "episodes": float(len(metrics)),
            "left": float((~metrics.stayed).sum()),
            "mean_return": float(metrics.episode_return.mean()),
            "rms_error_bar": float((metrics.rms_bar**2).mean() ** 0.5),
            "switchings_per_s": float(metrics.switchings_per_s.mean()),
        }
        if row["score"] > max((row["score"] for row in self._rows), default=-np.inf):
            write_policy(
                network, self._folder / BEST, control_period=OnOff.default_period,
                provenance={**self._provenance, "timesteps": self.num_timesteps},
            )  # fmt: skip
        self._rows.append(row)
        write_text(self._folder / VALIDATION_FILE, pd.DataFrame(self._rows).to_csv(index=False))


def seed_episodes(model: PPO, seed: int) -> None:
    """Let all that is drawn after the next reset depend on the training's seed and its steps alone."""
    env = model.get_env()
    assert env is not None
    set_random_seed(seed + model.num_timesteps)
    env.seed(first_training_seed(seed, model.num_timesteps, env.num_envs))


def train(
    task: Task,
    folder: Path,
    *,
    timesteps: int,
    seed: int = 0,
    num_envs: int = NUM_ENVS,
    validation_episodes: int = 1024,
    validation_duration: float = VALIDATION_DURATION,
    resume: bool = False,
    provenance: dict[str, Any] | None = None,
) -> list[dict[str, float]]:
    """Train until `timesteps`, and write the best validated policy into the folder.

    A training that was stopped goes on from its newest checkpoint, and ends with the same policy as an
    uninterrupted one.

    Args:
        task: what the policy is for.
        folder: of policy, checkpoints and validations.
        timesteps: environment steps in all.
        seed: of the training.
        num_envs: episodes side by side.
        validation_episodes: of each validation.
        validation_duration: length of one of them [s].
        resume: whether to go on from the folder's newest checkpoint.
        provenance: of the training, for the policy's file.

    Returns:
        A row for each validation.
    """
    torch.set_num_threads(1)  # sums do not depend on the machine's cores; the plant uses them all
    env = make_training_env(num_envs=num_envs, **vars(task))
    model = make_model(env, seed=seed)
    resumed = resume and load_checkpoint(model, folder, timesteps)
    model.set_logger(Logger(folder=None, output_formats=[]))  # the default leaves a folder in /tmp
    seed_episodes(model, seed)
    if model.num_timesteps < timesteps:
        with tqdm(
            total=timesteps, initial=model.num_timesteps, desc="PPO", unit="step", unit_scale=True,
            mininterval=0.5,
        ) as bar:  # fmt: skip
            course = Course(
                task, folder, bar, total=timesteps, seed=seed, episodes=validation_episodes,
                duration=validation_duration, provenance={"seed": seed, **(provenance or {})},
            )  # fmt: skip
            model.learn(
                timesteps - model.num_timesteps, callback=course, reset_num_timesteps=not resumed
            )
    contract, network = read_policy(folder / BEST)
    write_policy(network, folder, control_period=OnOff.default_period, provenance=contract.provenance)
    return read_rows(folder)


def checkpoints(folder: Path) -> list[Path]:
    """Those of a training's folder, the newest first."""
    return sorted((folder / CHECKPOINTS).glob("*.safetensors"), reverse=True)


def save_checkpoint(model: PPO, folder: Path) -> None:
    """Write what a training goes on from: weights, Adam's moments, and the number of steps.

    Learning rate and entropy follow from the steps, and what is drawn from `seed_episodes`.
    """
    weights = model.policy.state_dict()
    arrays = {f"weights {name}": array for name, array in weights.items()}
    states = model.policy.optimizer.state_dict()["state"]
    for number, name in enumerate(weights):  # as the optimiser counts them
        arrays |= {f"{kind} {name}": states[number][kind] for kind in ADAM}
    arrays["timesteps"] = torch.tensor(model.num_timesteps)
    write_bytes(folder / CHECKPOINTS / f"{model.num_timesteps:010}.safetensors", save(arrays))


def load_checkpoint(model: PPO, folder: Path, timesteps: int) -> bool:
    """Take up the newest checkpoint that is whole. Returns whether there is one.

    timesteps: of the whole training.
    """
    weights, optimiser = model.policy.state_dict(), model.policy.optimizer.state_dict()
    kinds = ("weights", *ADAM[1:])
    forms = {f"{kind} {n}": (w.shape, w.dtype) for n, w in weights.items() for kind in kinds}
    forms |= {f"{ADAM[0]} {name}": (torch.Size(), torch.float32) for name in weights}
    forms["timesteps"] = torch.Size(), torch.int64
    for path in checkpoints(folder):
        try:
            arrays = load(read_bytes(path))
        except (OSError, ValueError, KeyError, SafetensorError):
            continue  # torn
        found = {name: (array.shape, array.dtype) for name, array in arrays.items()}
        if found != forms or not all(_sane(*each) for each in arrays.items()):
            continue  # no training writes that
        if arrays["timesteps"] >= timesteps:
            continue  # it would end the training with the policy that there is
        states = {i: {k: arrays[f"{k} {name}"] for k in ADAM} for i, name in enumerate(weights)}
        model.policy.load_state_dict({name: arrays[f"weights {name}"] for name in weights})
        model.policy.optimizer.load_state_dict({**optimiser, "state": states})
        model.num_timesteps = int(arrays["timesteps"])
        return True
    return False


def _sane(name: str, array: torch.Tensor) -> bool:
    """Whether a training may go on from an array of a checkpoint: no infinities follow from it."""
    least = -LARGEST if name.startswith(("weights ", "exp_avg ")) else 0
    return bool(((array >= least) & (array <= LARGEST)).all())


def read_rows(folder: Path) -> list[dict[str, float]]:
    """The table of a folder's validations; empty if there was none."""
    path = folder / VALIDATION_FILE
    if not path.exists():
        return []
    try:
        table = pd.read_csv(BytesIO(read_bytes(path)), dtype=float)
    except ValueError:
        table = pd.DataFrame()
    if tuple(table) != ROW or not np.all(np.isfinite(table)):
        raise ValueError(f"{path} is damaged: begin the training anew, or choose another --out")
    rows: Any = table.to_dict("records")
    return rows
