"""Doubt in a set of causes whose remainder one more cause explains.

What a set leaves is an error of its forms, or another cause. Another cause explains an error of form by
chance, and rarely nearly all of it (`RankingSettings.completing_share`). So a set is the less probable,
the less of its remainder stays beside one more cause, however little it leaves of the whole gap.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

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
    names = [frozenset(cause.name for cause in each.estimate.hypothesis.causes) for each in hypotheses]
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
