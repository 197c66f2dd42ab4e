"""Which of the policies that a training passes through is kept: the best on scenarios of its own.

The choice is part of the training, as early stopping is: it sees neither the scenarios of the
evaluation nor those on which the classic controllers are tuned.
"""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from controllers.base import Controller
from training.evaluation.metrics import EpisodeMetrics
from training.evaluation.rollout import run_episodes
from training.evaluation.seeds import VALIDATION_SEED
from training.learners.learning_log import read_rows, save_model, write_rows

VALIDATION_FILE = "validation.csv"
BEST_FILE = "model.zip"

LEAVING_PRICE = 300.0
"""What an episode that leaves the band loses in the score, beside its return: somewhat more than a good
episode loses in all, because such an episode is rare and the return's mean would hardly show it."""


def validation_points(total: int, *, first_share: float, count: int) -> list[int]:
    """Steps of a training of `total` at which it is validated: evenly from a share of it to its end."""
    step = (1 - first_share) / max(count - 1, 1)
    return [round(total * (1 - step * (count - 1 - k))) for k in range(count)]


def score(metrics: EpisodeMetrics) -> float:
    """How good a policy is: its mean return, less the price of leaving the band."""
    return float(metrics.episode_return.mean() - LEAVING_PRICE * (~metrics.stayed).mean())


class Selection(BaseCallback):
    """Validates the greedy policy at some points of the training; the best model is in BEST_FILE."""

    def __init__(
        self,
        folder: Path,
        *,
        points: Iterable[int],
        episodes: int,
        duration: float,
        options: dict[str, Any],
        controller: Callable[[PPO], Controller],
    ):
        """points: steps at which to validate. duration: of an episode [s]. options: environment's.

        controller: makes a controller of a model, its greedy policy.
        """
        super().__init__()
        self._folder = folder
        self._points = sorted(points)
        self._seeds = list(range(VALIDATION_SEED, VALIDATION_SEED + episodes))
        self._duration = duration
        self._options = options
        self._controller = controller
        self.rows = read_rows(folder / VALIDATION_FILE)
        """One for each validation, that of a resumed training's earlier part included."""

    def _on_training_start(self) -> None:
        if self.num_timesteps == 0:
            self.rows = []
        self._points = [point for point in self._points if point > self.num_timesteps]

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        self._validate_if_due()

    def _on_training_end(self) -> None:
        self._validate_if_due()

    def _validate_if_due(self) -> None:
        """Validate once for all points that have been passed since the last time."""
        remaining = [point for point in self._points if point > self.num_timesteps]
        if len(remaining) < len(self._points):
            self._points = remaining
            self._validate()

    def _validate(self) -> None:
        assert isinstance(self.model, PPO)
        metrics, _ = run_episodes(
            self._controller(self.model), seeds=self._seeds, duration=self._duration,
            options=self._options,
        )  # fmt: skip
        best = max((row["score"] for row in self.rows), default=float("-inf"))
        self.rows.append({"timesteps": float(self.num_timesteps), **figures(metrics)})
        if self.rows[-1]["score"] > best:
            save_model(self.model, self._folder / BEST_FILE)
        write_rows(self._folder / VALIDATION_FILE, list(self.rows[0]), self.rows)

    def restore_best(self, model: PPO) -> None:
        """Give the model the parameters of the best one so far."""
        model.set_parameters(str(self._folder / BEST_FILE), device=model.device)


def figures(metrics: EpisodeMetrics) -> dict[str, float]:
    """What the validation's table says of a policy."""
    return {
        "score": score(metrics),
        "mean_return": float(metrics.episode_return.mean()),
        "left": float((~metrics.stayed).sum()),
        "worst_excursion_bar": float(metrics.excursion_bar.max()),
        "largest_breakdown_bar": float(metrics.breakdown_bar.max()),
        "rms_error_bar": float((metrics.rms_bar**2).mean() ** 0.5),
        "switchings_per_s": float(metrics.switchings_per_s.mean()),
    }
