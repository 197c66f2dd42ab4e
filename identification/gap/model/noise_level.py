"""The noise of a channel whose sensor nobody describes: from differences of neighbouring readings.

White noise shows in differences of neighbours (Rice 1984; second differences: Gasser, Sroka and
Jennen-Steinmetz 1986), a smooth course hardly does. The median over blocks leaves out where it moves
fast. Readings in coarse steps may not differ at all: then the step tells how far they may be off.
"""

from collections.abc import Sequence
from math import comb

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.settings import PreparationSettings

STEP_TO_SD = float(np.sqrt(1.0 / 12.0))
"""Standard deviation of rounding to a step, in steps."""


def white_noise(series: Sequence[NDArray], settings: PreparationSettings) -> float:
    """Standard deviation of white noise on readings about a smooth course.

    Args:
        series: consecutive trusted readings of each run, (readings,) [unit of the readings].
        settings: orders of differences and length of blocks.

    Returns:
        In the unit of the readings; 0 where most neighbours are equal, NaN where no run has enough
        readings.
    """
    levels = [_from_differences(series, order, settings) for order in settings.difference_orders]
    known = [level for level in levels if not np.isnan(level)]
    return min(known, default=float("nan"))


def quantisation_step(series: Sequence[NDArray], settings: PreparationSettings) -> float:
    """Step of which all readings are multiples, but for an offset.

    series: readings of each run, (readings,) [unit of the readings]. settings: when differences are
    multiples. Returns the step in the unit of the readings, 0 where there is none.
    """
    values = np.unique(np.concatenate([np.zeros(0), *series]))
    if len(values) < 2:
        return 0.0
    gaps = np.diff(values)
    gaps = gaps[gaps > settings.largest_rounding * (values[-1] - values[0])]
    if len(gaps) < settings.fewest_values:
        return 0.0
    step = float(np.quantile(gaps, settings.step_quantile, method="lower"))
    multiples = gaps / step
    close = np.abs(multiples - np.round(multiples)) <= settings.step_tolerance
    return step if np.mean(close) >= settings.share_of_multiples else 0.0


def _from_differences(series: Sequence[NDArray], order: int, settings: PreparationSettings) -> float:
    """Noise by differences of one order; NaN where no run has enough readings."""
    scale = 1.0 / np.sqrt(comb(2 * order, order))  # root of the sum of squared binomial coefficients
    blocks = [
        block
        for readings in series
        if len(readings) > order
        for block in _blocks(scale * np.diff(readings, order), settings.noise_block_readings)
    ]
    if not blocks:
        return float("nan")
    freedom = min(len(block) for block in blocks) / _correlated_readings(order)
    # The median of a chi-square variable over its mean (Wilson and Hilferty 1931).
    median_to_mean = (1.0 - 2.0 / (9.0 * max(freedom, 1.0))) ** 3
    return float(np.sqrt(np.median([np.mean(block**2) for block in blocks]) / median_to_mean))


def _blocks(differences: NDArray, length: int) -> list[NDArray]:
    """Differences (readings,) in blocks of at least this length, or in one block."""
    return np.array_split(differences, max(1, len(differences) // length))


def _correlated_readings(order: int) -> float:
    """Number of differences of white noise that tell as much as one independent value."""
    weights = np.diff(np.eye(1, 2 * order + 1, order)[0], order)
    correlation = np.correlate(weights, weights, "full") / (weights @ weights)
    return float(np.sum(correlation**2))
