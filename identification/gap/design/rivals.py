"""Rivals: the hypotheses between which the next experiment is to decide."""

from dataclasses import dataclass

import numpy as np

from identification.gap.design.settings import DesignSettings
from identification.gap.fit.hypothesis import Estimate
from identification.gap.rank.ranking import Ranking


@dataclass(frozen=True, kw_only=True)
class Rivals:
    """Hypotheses between which an experiment is to decide, the most probable first."""

    estimates: tuple[Estimate, ...]
    probability: tuple[float, ...]
    """Before the experiment, (rivals,); sums to 1."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names for files."""
        return tuple(" + ".join(each.hypothesis.labels) or "no cause" for each in self.estimates)

    @property
    def titles(self) -> tuple[str, ...]:
        """Names for people."""
        return tuple(" + ".join(each.hypothesis.titles) or "no cause" for each in self.estimates)


def select_rivals(ranking: Ranking, settings: DesignSettings | None = None) -> Rivals:
    """The most probable hypotheses of a diagnosis, the recalibrated model among them."""
    settings = settings or DesignSettings()
    named = [
        (hypothesis.estimate, probability)
        for hypothesis, probability in zip(ranking.hypotheses, ranking.probabilities, strict=True)
    ]
    named.append((ranking.recalibrated.estimate, ranking.no_cause))
    named.sort(key=lambda pair: -pair[1])
    total = max(sum(p for _, p in named), np.finfo(float).tiny)
    share = np.cumsum([p for _, p in named]) / total
    enough = np.searchsorted(share, settings.probability_held_by_rivals) + 1
    count = int(np.clip(enough, 2, min(settings.most_rivals, len(named))))
    chosen = np.array([p for _, p in named[:count]])
    chosen = chosen / np.sum(chosen) if np.any(chosen) else np.full(count, 1.0 / count)
    return Rivals(
        estimates=tuple(estimate for estimate, _ in named[:count]), probability=tuple(chosen.tolist())
    )
