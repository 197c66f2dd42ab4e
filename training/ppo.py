"""PPO on the native vector environment: hyperparameters, model, progress, checkpoints."""

import csv
import io
import os
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecMonitor
from tqdm import tqdm

from epv_env.plant.files import write_text
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from epv_env.sb3 import make_sb3_env

CHECKPOINT_FILE = "checkpoint.zip"
CURVE_FILE = "learning_curve.csv"
CURVE_COLUMNS = ("timesteps", "seconds", "episode_return", "success_rate")


@dataclass(frozen=True, kw_only=True)
class Hyperparameters:
    """What defines the training; the rest is stable-baselines3's default."""

    num_envs: int = 512
    episode_steps: int = 600
    """Control periods of a training episode (3 s)."""
    n_steps: int = 64
    batch_size: int = 8192
    n_epochs: int = 6
    learning_rate: float = 1e-3
    """At the start; it falls linearly to a tenth."""
    gamma: float = 0.995
    gae_lambda: float = 0.95
    ent_coef: float = 0.003
    first_switching_price: float = 0.02
    """The price of switching rises linearly from this to the reward's own over `rising_share`: priced in
    full from the start, learning tends to end where the coil is never switched."""
    rising_share: float = 0.6
    """Share of the training over which it rises."""
    width: int = 64
    """Of the two hidden layers."""


def make_training_env(
    h: Hyperparameters,
    *,
    plant: Plant,
    scenario: str,
    parameters: str,
    seed: int,
    weights: RewardWeights,
) -> VecMonitor:
    """Episodes on plants drawn from a region, "confidence" or another (epv_env.settings)."""
    env = make_sb3_env(
        "EPValve-v0",
        h.num_envs,
        max_episode_steps=h.episode_steps,
        plant=plant,
        parameters=parameters,
        scenario=scenario,
        weights=weights,
    )
    env.seed(seed)
    return VecMonitor(env)


def make_model(h: Hyperparameters, env: VecMonitor, *, seed: int, device: str) -> PPO:
    """A new PPO model."""
    return PPO(
        "MlpPolicy",
        env,
        n_steps=h.n_steps,
        batch_size=h.batch_size,
        n_epochs=h.n_epochs,
        learning_rate=lambda remaining: h.learning_rate * (0.1 + 0.9 * remaining),
        gamma=h.gamma,
        gae_lambda=h.gae_lambda,
        ent_coef=h.ent_coef,
        policy_kwargs={"net_arch": [h.width, h.width]},
        seed=seed,
        device=device,
    )


class RisingPrice(BaseCallback):
    """Raises the price of switching as training goes on."""

    def __init__(self, h: Hyperparameters, weights: RewardWeights, total: int):
        super().__init__()
        self._first = min(h.first_switching_price, weights.switching)
        self._weights = weights
        self._steps = h.rising_share * total

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        share = min(self.num_timesteps / self._steps, 1.0)
        price = self._first + share * (self._weights.switching - self._first)
        self.training_env.env_method("set_weights", replace(self._weights, switching=price))


class TrainingLog(BaseCallback):
    """Progress bar with estimate and success rate, learning curve, and checkpoints to resume from."""

    def __init__(self, folder: Path, total: int, *, checkpoint_seconds: float = 20.0, quiet: bool):
        super().__init__()
        self._folder = folder
        self._total = total
        self._quiet = quiet
        self._checkpoint_seconds = checkpoint_seconds
        self._saved_at = time.monotonic()
        self.rows = read_curve(folder / CURVE_FILE)
        self._bar: tqdm | None = None

    def _on_training_start(self) -> None:
        self.rows = [row for row in self.rows if row["timesteps"] <= self.num_timesteps]
        self._spent = self.rows[-1]["seconds"] if self.rows else 0.0
        self._begun = time.monotonic()
        self._bar = tqdm(
            total=self._total, initial=self.num_timesteps, desc="PPO", unit="step",
            unit_scale=True, disable=self._quiet, mininterval=0.5,
        )  # fmt: skip

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        episodes = self.model.ep_info_buffer or []
        successes = self.model.ep_success_buffer or []
        row = {
            "timesteps": float(self.num_timesteps),
            "seconds": self._spent + time.monotonic() - self._begun,
            "episode_return": float(np.mean([e["r"] for e in episodes])) if episodes else np.nan,
            "success_rate": float(np.mean(successes)) if successes else np.nan,
        }
        self.rows.append(row)
        if self._bar is not None:
            self._bar.update(min(self.num_timesteps, self._total) - self._bar.n)
            self._bar.set_postfix(
                success=f"{row['success_rate']:.0%}", episode_return=f"{row['episode_return']:.1f}"
            )
        if time.monotonic() - self._saved_at > self._checkpoint_seconds:
            self.save()

    def _on_training_end(self) -> None:
        self.save()
        if self._bar is not None:
            self._bar.close()

    def save(self) -> None:
        """Write checkpoint and learning curve."""
        save_model(self.model, self._folder / CHECKPOINT_FILE)
        text = io.StringIO()
        writer: csv.DictWriter[str] = csv.DictWriter(text, list(CURVE_COLUMNS))
        writer.writeheader()
        writer.writerows(self.rows)
        write_text(self._folder / CURVE_FILE, text.getvalue())
        self._saved_at = time.monotonic()


def save_model(model: Any, path: Path) -> None:
    """Save a stable-baselines3 model, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(".part.zip")
    model.save(temporary)
    os.replace(temporary, path)


def read_curve(path: Path) -> list[dict[str, float]]:
    """The learning curve so far; empty if there is none."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as stream:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(stream)]


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
    quiet: bool = False,
) -> tuple[PPO, TrainingLog]:
    """Train until `timesteps`; resume goes on from the folder's checkpoint.

    An interruption (Ctrl-C) leaves the newest checkpoint behind. A resumed run draws new episodes, so it
    is a continuation, not a repetition, of an uninterrupted one.
    """
    torch.set_num_threads(1)  # sums do not depend on the machine's cores; the plant uses them all
    checkpoint = folder / CHECKPOINT_FILE
    done = 0
    env = make_training_env(
        h, plant=plant, scenario=scenario, parameters=parameters, weights=weights, seed=seed
    )
    model = make_model(h, env, seed=seed, device=device)
    if resume and checkpoint.exists():
        model.set_parameters(str(checkpoint), device=device)
        done = int(read_curve(folder / CURVE_FILE)[-1]["timesteps"])
        env.seed(seed + done)
    log = TrainingLog(folder, timesteps, quiet=quiet)
    if done < timesteps:
        model.num_timesteps = done
        try:
            model.learn(
                timesteps - done,
                callback=[RisingPrice(h, weights, timesteps), log],
                reset_num_timesteps=done == 0,
            )
        except KeyboardInterrupt:
            log.save()
            raise
    return model, log
