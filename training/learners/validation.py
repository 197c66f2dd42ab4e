"""Validation of a policy during its training: a score on episodes that are kept for it.

The choice among a training's policies is part of the training, as early stopping is: it sees neither the
scenarios of the evaluation nor those on which the classic controllers are tuned.
"""

from dataclasses import dataclass
from typing import Any

from controllers.base import Controller
from training.evaluation.metrics import EpisodeMetrics
from training.evaluation.rollout import run_episodes
from training.evaluation.seeds import VALIDATION_SEED


@dataclass(frozen=True, kw_only=True)
class ValidationSettings:
    """Size and score of a validation."""

    episodes: int
    """Number of episodes."""
    duration: float
    """Length of an episode [s]."""
    violation_price: float = 300.0
    """Loss of score by an episode with a constraint violation, beside its return. It is somewhat more
    than a good episode loses in all: violations are rare, so the mean return would hardly show one."""


def validate(
    policy: Controller, settings: ValidationSettings, options: dict[str, Any]
) -> EpisodeMetrics:
    """The policy's metrics on the validation episodes. options: of the environment."""
    seeds = list(range(VALIDATION_SEED, VALIDATION_SEED + settings.episodes))
    metrics, _ = run_episodes(policy, seeds=seeds, duration=settings.duration, options=options)
    return metrics


def score(metrics: EpisodeMetrics, violation_price: float = ValidationSettings.violation_price) -> float:
    """How good a policy is: its mean return less the price of its violation rate."""
    return float(metrics.episode_return.mean() - violation_price * (~metrics.stayed).mean())
