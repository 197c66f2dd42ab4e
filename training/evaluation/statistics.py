"""Statistics of a comparison: bootstrap intervals, and differences paired by episode.

Controllers meet the same episodes (common random numbers), so a difference is taken episode by episode,
and its interval is that of the mean of these differences.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap, norm, sem

RESAMPLES = 2000
"""Resamples behind each interval: its ends then move by about 3 % of its width with the seed."""
MANY = 20_000
"""Values whose mean is normal: resampling would give the same interval, and take seconds."""
BATCH_VALUES = 4_000_000
"""Values that a bootstrap draws at a time: bounds its memory."""


class Estimate(NamedTuple):
    """A mean with its 95 % interval."""

    value: float
    low: float
    high: float


def mean_interval(values: NDArray) -> tuple[float, float]:
    """Ends of the 95 % interval of a mean of values (n,), by the bootstrap unless they are many."""
    if np.ptp(values) == 0:
        return float(values[0]), float(values[0])
    if len(values) > MANY:
        low, high = norm.interval(0.95, values.mean(), sem(values))
        return float(low), float(high)
    interval = bootstrap(
        (values,), np.mean, n_resamples=RESAMPLES, confidence_level=0.95, method="percentile",
        rng=np.random.default_rng(0), batch=max(BATCH_VALUES // len(values), 1),
    ).confidence_interval  # fmt: skip
    return float(interval.low), float(interval.high)


def paired_difference(ours: NDArray, theirs: NDArray) -> Estimate:
    """Mean of ours - theirs over the episodes that both have met, the first ones of each, (n,) and
    (m,)."""
    common = min(len(ours), len(theirs))
    difference = ours[:common] - theirs[:common]
    return Estimate(float(difference.mean()), *mean_interval(difference))
