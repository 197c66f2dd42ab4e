"""Selection of the best model that a training passes through, judged by its validations."""

import io
from collections.abc import Callable, Iterable
from typing import Any

from stable_baselines3 import PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback

from controllers.base import Controller
from training.evaluation.metrics import EpisodeMetrics
from training.learners.run_state import Row
from training.learners.validation import ValidationSettings, score, validate


def validation_points(total: int, *, first_share: float, count: int) -> list[int]:
    """Steps of a training of `total` at which it is validated: evenly from a share of it to its end."""
    step = (1 - first_share) / max(count - 1, 1)
    return [round(total * (1 - step * (count - 1 - k))) for k in range(count)]


class Selection(BaseCallback):
    """Validates the greedy policy at some points of the training, and keeps the best model."""

    def __init__(
        self,
        *,
        points: Iterable[int],
        settings: ValidationSettings,
        options: dict[str, Any],
        controller: Callable[[PPO], Controller],
        rows: list[Row],
        best: bytes | None,
    ):
        """
        Args:
            points: environment steps after which the policy is validated.
            settings: of a validation.
            options: of the environment.
            controller: makes a controller of a model, its greedy policy.
            rows: of the earlier part of a resumed training, one for each validation.
            best: the archive of the best model of that part; None: it was not validated.
        """
        super().__init__()
        self._points = sorted(points)
        self.settings = settings
        self.options = options
        self._controller = controller
        self.rows = rows
        """One for each validation, those of a resumed training's earlier part included."""
        self.best = best
        """The archive of the best model so far; None before the first validation."""

    def _on_training_start(self) -> None:
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
        metrics = validate(self._controller(self.model), self.settings, self.options)
        best = max((row["score"] for row in self.rows), default=float("-inf"))
        row = {"timesteps": float(self.num_timesteps), **figures(metrics, self.settings)}
        self.rows.append(row)
        if row["score"] > best:
            self.best = archive_of(self.model)


def archive_of(model: BaseAlgorithm) -> bytes:
    """stable-baselines3's archive of a model."""
    stream = io.BytesIO()
    model.save(stream)
    return stream.getvalue()


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
