"""Log of a running training: progress bar, learning curve, and checkpoints to resume from."""

import csv
import io
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from tqdm import tqdm

from epv_env.common.files import write_bytes, write_text
from training.learners.checkpoint_selection import Selection, archive_of
from training.learners.resumption import save_progress
from training.learners.run_state import (
    CHECKPOINT_FILE,
    DERIVED_FILES,
    Checkpoint,
    Row,
    Run,
    save_run,
    with_nan,
    without_nan,
)

CURVE_FILE, VALIDATION_FILE, BEST_FILE = DERIVED_FILES
CHECKPOINT_SECONDS = 20.0
"""Least time between two checkpoints [s]: what a killed training loses at most."""

CURVE_COLUMNS = ("timesteps", "seconds", "episode_return", "success_rate")


class TrainingLog(BaseCallback):
    """Progress bar with estimate and success rate, learning curve, and checkpoints to resume from."""

    def __init__(
        self,
        folder: Path,
        run: Run,
        selection: Selection,
        *,
        total: int,
        quiet: bool,
    ):
        """
        Args:
            folder: of checkpoint and learning curve.
            run: what was done before; its identity stands in all that is written.
            selection: whose validations and best model are kept with the rest.
            total: environment steps of the whole training.
            quiet: no progress bar.
        """
        super().__init__()
        self.run = run
        """Identity of the run, and what was done before."""
        self._folder = folder
        self._selection = selection
        self._total = total
        self._quiet = quiet
        self._saved_at = float("-inf")  # the first checkpoint follows the imitation
        self.rows = with_nan(run.curve)
        """Of the learning curve, by CURVE_COLUMNS."""
        self._bar: tqdm | None = None

    def _on_training_start(self) -> None:
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
        if time.monotonic() - self._saved_at > CHECKPOINT_SECONDS:
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
        """Write the checkpoint, then the tables and the best model that it holds for its user."""
        assert isinstance(self.model, PPO)
        validations = self._selection.rows
        run = Run(
            run=self.run.run, subject=self.run.subject, timesteps=self.num_timesteps,
            curve=without_nan(self.rows), validations=without_nan(validations),
        )  # fmt: skip
        best = self._selection.best
        checkpoint = Checkpoint(run, best, save_progress(self.model))
        save_run(self._folder / CHECKPOINT_FILE, checkpoint, model=archive_of(self.model))
        write_rows(self._folder / CURVE_FILE, CURVE_COLUMNS, self.rows, run=run.run)
        if best is not None:
            write_rows(self._folder / VALIDATION_FILE, list(validations[0]), validations, run=run.run)
            write_bytes(self._folder / BEST_FILE, best)
        self._saved_at = time.monotonic()


def write_rows(path: Path, columns: Sequence[str], rows: list[Row], *, run: str) -> None:
    """Write a table of numbers as a CSV file with a heading; each row names its run last."""
    text = io.StringIO()
    writer: csv.DictWriter[str] = csv.DictWriter(text, [*columns, "run"])
    writer.writeheader()
    writer.writerows({**row, "run": run} for row in rows)
    write_text(path, text.getvalue())
