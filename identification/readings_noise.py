"""White noise and quantisation step of readings, as the readings themselves show them.

White noise shows in differences of neighbouring readings (Rice 1984; second differences: Gasser, Sroka
and Jennen-Steinmetz 1986), a smooth course hardly does. The median over blocks leaves out where it moves
fast. Readings in coarse steps may not differ at all: then the step tells how far they may be off.
"""

from collections.abc import Sequence
from math import comb

import numpy as np
from numpy.typing import NDArray

BLOCK_READINGS = 20
"""Length of a block whose noise is estimated by itself [readings]: four blocks in a run of 80 readings,
and motion in some of them does not move the median."""

DIFFERENCE_ORDERS = (2, 4)
"""Orders of the differences of neighbouring readings that show the noise; the least estimate counts. The
second suffices for finely sampled runs; the fourth removes the motion of runs with a few dozen readings
per transient as well."""

LARGEST_ROUNDING = 1e-9
"""Distance of two readings that is rounding of the same value, relative to the range of half of them
[1]."""

STEP_QUANTILE = 0.1
"""Quantile of the distances of neighbouring values that is tried as the step of a quantised channel [1]:
most values of a range occur, so that a small quantile is one step."""

STEP_TOLERANCE = 0.05
"""Distance of a difference from the next multiple of the step up to which it is one [steps]."""

SHARE_OF_MULTIPLES = 0.95
"""Share of differences that must be multiples of the step [1]: all but faulty readings."""

FEWEST_DISTANCES = 4
"""Fewest distances of neighbouring values that can show a step: by chance two may be alike."""

ROBUST_ORDERS = (2, 4, 6)
"""Orders of the differences where readings may be faulty; motion enters the low ones."""

NORMAL = 1.4826
"""Standard deviation of a normal variable over the median of its magnitude [1]."""


def white_noise(series: Sequence[NDArray]) -> float:
    """Standard deviation of white noise on readings about a smooth course.

    Args:
        series: consecutive trusted readings of each run, (readings,) [unit of the readings].

    Returns:
        In the unit of the readings; 0 where most neighbours are equal, NaN where no run has enough
        readings.
    """
    levels = [_from_differences(series, order) for order in DIFFERENCE_ORDERS]
    known = [level for level in levels if not np.isnan(level)]
    return min(known, default=float("nan"))


def noise_despite_faults(series: Sequence[NDArray]) -> float:
    """Noise about a smooth course [unit], of which up to half of the readings may be faulty.

    By the median magnitude of differences of some orders, the least of them.

    series: readings of each run, (readings,) [unit]. Returns 0 where no run has enough readings.
    """
    levels = [
        NORMAL * np.median(np.abs(np.concatenate([differences(readings, order) for readings in series])))
        for order in ROBUST_ORDERS
        if any(len(readings) > order for readings in series)
    ]
    return float(min(levels, default=0.0))


def rounding_error(step: float) -> float:
    """Standard deviation of the rounding to a step, in the step's unit."""
    return float(step / np.sqrt(12.0))


@np.errstate(over="ignore", invalid="ignore")  # an absurd reading is no multiple
def quantisation_step(series: Sequence[NDArray], fewest: int = FEWEST_DISTANCES) -> float:
    """Step of which all readings are multiples, but for an offset.

    Args:
        series: readings of each run, (readings,) [unit of the readings].
        fewest: distances of neighbouring values that are enough to tell a step.

    Returns:
        In the unit of the readings; 0 where there is none.
    """
    gaps = distances(series)
    if len(gaps) < fewest:
        return 0.0
    step = float(np.quantile(gaps, STEP_QUANTILE, method="lower"))
    multiples = gaps / step
    close = np.abs(multiples - np.round(multiples)) <= STEP_TOLERANCE
    return step if np.mean(close) >= SHARE_OF_MULTIPLES else 0.0


def distances(series: Sequence[NDArray]) -> NDArray:
    """Distances of neighbouring values among all readings, (values - 1,); rounding is none.

    series: readings of each run, (readings,).
    """
    values = np.unique(np.concatenate([np.zeros(0), *series]))
    if len(values) < 2:
        return np.zeros(0)
    low, high = np.quantile(values, (0.25, 0.75))  # faulty readings may lie anywhere
    gaps = np.diff(values)
    return gaps[gaps > LARGEST_ROUNDING * (high - low)]


def differences(readings: NDArray, order: int) -> NDArray:
    """Differences of readings (n,) with the standard deviation of their white noise, (n - order,)."""
    return np.diff(readings, order) / np.sqrt(comb(2 * order, order))


def _from_differences(series: Sequence[NDArray], order: int) -> float:
    """Noise by differences of one order; NaN where no run has enough readings."""
    blocks = [
        block
        for readings in series
        if len(readings) > order
        for block in _blocks(differences(readings, order), BLOCK_READINGS)
    ]
    if not blocks:
        return float("nan")
    freedom = min(len(block) for block in blocks) / _correlated_readings(order)
    return noise_of_blocks([float(np.mean(block**2)) for block in blocks], max(freedom, 1.0))


def noise_of_blocks(variances: NDArray | Sequence[float], freedom: float) -> float:
    """Standard deviation of white noise from its variance in blocks of readings, a few of them lively.

    variances: (blocks,). freedom: independent values in a block. The median of a chi-square variable
    becomes its mean (Wilson and Hilferty 1931).
    """
    return float(np.sqrt(np.median(variances) / (1.0 - 2.0 / (9.0 * freedom)) ** 3))


def _blocks(differences: NDArray, length: int) -> list[NDArray]:
    """Differences (readings,) in blocks of at least this length, or in one block."""
    return np.array_split(differences, max(1, len(differences) // length))


def _correlated_readings(order: int) -> float:
    """Number of differences of white noise that tell as much as one independent value."""
    weights = np.diff(np.eye(1, 2 * order + 1, order)[0], order)
    correlation = np.correlate(weights, weights, "full") / (weights @ weights)
    return float(np.sum(correlation**2))
