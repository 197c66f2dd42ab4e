"""Selection of the best model that a training passes through, judged by its validations."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from controllers.base import Controller
from training.evaluation.metrics import EpisodeMetrics
from training.learners.learning_log import read_rows, save_model, write_rows
from training.learners.validation import ValidationSettings, score, validate

VALIDATION_FILE = "validation.csv"
BEST_FILE = "model.zip"


def validation_points(total: int, *, first_share: float, count: int) -> list[int]:
    """Steps of a training of `total` at which it is validated: evenly from a share of it to its end."""
    step = (1 - first_share) / max(count - 1, 1)
    return [round(total * (1 - step * (count - 1 - k))) for k in range(count)]


class Selection(BaseCallback):
    """Validates the greedy policy at some points of the training; the best model is in BEST_FILE."""

    def __init__(
        self,
        folder: Path,
        *,
        points: Iterable[int],
        settings: ValidationSettings,
        options: dict[str, Any],
        controller: Callable[[PPO], Controller],
    ):
        """
        Args:
            folder: of the training.
            points: environment steps after which the policy is validated.
            settings: of a validation.
            options: of the environment.
            controller: makes a controller of a model, its greedy policy.
        """
        super().__init__()
        self._folder = folder
        self._points = sorted(points)
        self._settings = settings
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
        metrics = validate(self._controller(self.model), self._settings, self._options)
        best = max((row["score"] for row in self.rows), default=float("-inf"))
        row = {"timesteps": float(self.num_timesteps), **figures(metrics, self._settings)}
        self.rows.append(row)
        if row["score"] > best:
            save_model(self.model, self._folder / BEST_FILE)
        write_rows(self._folder / VALIDATION_FILE, list(self.rows[0]), self.rows)

    def restore_best(self, model: PPO) -> None:
        """Give the model the parameters of the best one so far."""
        model.set_parameters(str(self._folder / BEST_FILE), device=model.device)


def figures(metrics: EpisodeMetrics, settings: ValidationSettings) -> dict[str, float]:
    """A row of the validation's table by column. `left` counts episodes with a constraint violation."""
    return {
        "score": score(metrics, settings.violation_price),
        "mean_return": float(metrics.episode_return.mean()),
        "left": float((~metrics.stayed).sum()),
        "worst_excursion_bar": float(metrics.excursion_bar.max()),
        "largest_breakdown_bar": float(metrics.breakdown_bar.max()),
        "rms_error_bar": float((metrics.rms_bar**2).mean() ** 0.5),
        "switchings_per_s": float(metrics.switchings_per_s.mean()),
    }
