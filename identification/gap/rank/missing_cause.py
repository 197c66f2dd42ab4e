"""Doubt whether a set of causes is complete.

What a set leaves is an error of its forms, or another cause. Another cause explains an error of form by
chance, and rarely nearly all of it (`RankingSettings.completing_share`). So a set is the less probable,
the less of its remainder stays beside one more cause, however little it leaves of the whole gap.

Where the remainder is far above the noise, another cause may also hide in the error of form: no fit can
show it. A share of the set's probability then belongs to the set with one more cause.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from identification.gap.rank.evidence import EvaluatedHypothesis
from identification.gap.rank.settings import RankingSettings


def log_completeness(
    hypotheses: Sequence[EvaluatedHypothesis], misfits: NDArray, settings: RankingSettings
) -> NDArray:
    """Log probability that each set of causes lacks none that another set has, (n,) [nats].

    Args:
        hypotheses: sets of causes, n of them.
        misfits: of each beyond noise, (n,) [nats].
        settings: judgement.
    """
    names = _names(hypotheses)
    possible = [not each.at_bound for each in hypotheses]
    reached = np.maximum(misfits, 0.0) + settings.chance_misfit
    shares = np.ones(len(hypotheses))
    for i, own in enumerate(names):
        with_another = [
            reached[j]
            for j, other in enumerate(names)
            if possible[j] and len(other - own) == 1 and reached[j] < reached[i]
        ]
        shares[i] = min(with_another, default=reached[i]) / reached[i]
    odds = (shares / settings.completing_share) ** settings.completing_slope
    return np.where(shares < 1.0, np.log(odds) - np.log1p(odds), 0.0)


def with_hidden_causes(
    probabilities: NDArray,
    hypotheses: Sequence[EvaluatedHypothesis],
    misfits: NDArray,
    scores: NDArray,
    settings: RankingSettings,
) -> NDArray:
    """Probabilities of sets of causes where one more cause may hide in errors of form, (n,).

    A set passes a share on to the sets that were tried with one more cause, by their scores. The sum
    and the probability that a cause of the set is part of the gap stay.

    Args:
        probabilities: of sets of causes, (n,).
        hypotheses: the sets, n of them.
        misfits: of each beyond noise, (n,) [nats].
        scores: log probability of each, but for a constant, (n,) [nats].
        settings: judgement.
    """
    names = _names(hypotheses)
    spread = probabilities.copy()
    for i, own in enumerate(names):
        larger = [
            j
            for j, other in enumerate(names)
            if own < other and len(other) == len(own) + 1 and not hypotheses[j].at_bound
        ]
        if not larger or misfits[i] <= 0.0:
            continue
        share = settings.hidden_share / (1.0 + (settings.hiding_misfit / misfits[i]) ** 2)
        spread[i] -= share * probabilities[i]
        spread[larger] += share * probabilities[i] * softmax(scores[larger])
    return spread


def _names(hypotheses: Sequence[EvaluatedHypothesis]) -> list[frozenset[str]]:
    """Names of the causes of each hypothesis."""
    return [frozenset(cause.name for cause in each.estimate.hypothesis.causes) for each in hypotheses]
