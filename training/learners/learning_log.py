"""Log of a running training: progress bar, learning curve, and checkpoints to resume from."""

import csv
import io
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from tqdm import tqdm

from epv_env.common.files import write_text

CHECKPOINT_FILE = "checkpoint.zip"
CURVE_FILE = "learning_curve.csv"
CURVE_COLUMNS = ("timesteps", "seconds", "episode_return", "success_rate")


class TrainingLog(BaseCallback):
    """Progress bar with estimate and success rate, learning curve, and checkpoints to resume from."""

    def __init__(self, folder: Path, total: int, *, checkpoint_seconds: float = 20.0, quiet: bool):
        """
        Args:
            folder: of checkpoint and learning curve.
            total: environment steps of the whole training.
            checkpoint_seconds: least time between two checkpoints [s].
            quiet: no progress bar.
        """
        super().__init__()
        self._folder = folder
        self._total = total
        self._quiet = quiet
        self._checkpoint_seconds = checkpoint_seconds
        self._saved_at = time.monotonic()
        self.rows = read_rows(folder / CURVE_FILE)
        """Of the learning curve, by CURVE_COLUMNS."""
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

    def _on_rollout_start(self) -> None:
        """Save between an update and the next rollout: the model has learned from all steps counted."""
        if time.monotonic() - self._saved_at > self._checkpoint_seconds:
            self.save()

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

    def _on_training_end(self) -> None:
        self.save()
        if self._bar is not None:
            self._bar.close()

    def save(self) -> None:
        """Write checkpoint and learning curve."""
        save_model(self.model, self._folder / CHECKPOINT_FILE)
        write_rows(self._folder / CURVE_FILE, CURVE_COLUMNS, self.rows)
        self._saved_at = time.monotonic()


def save_model(model: Any, path: Path) -> None:
    """Save a stable-baselines3 model, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(".part.zip")
    model.save(temporary)
    os.replace(temporary, path)


def read_rows(path: Path) -> list[dict[str, float]]:
    """The rows of a table of numbers, a CSV file with a heading; empty if there is none."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as stream:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(stream)]


def write_rows(path: Path, columns: Sequence[str], rows: list[dict[str, float]]) -> None:
    """Write a table of numbers as a CSV file with a heading."""
    text = io.StringIO()
    writer: csv.DictWriter[str] = csv.DictWriter(text, list(columns))
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, text.getvalue())
