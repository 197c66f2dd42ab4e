"""Noise of readings, as the readings themselves show it: white, in steps, or correlated.

White noise shows in differences of neighbouring readings (Rice 1984; second differences: Gasser, Sroka
and Jennen-Steinmetz 1986), a smooth course hardly does. The median over blocks leaves out where it moves
fast. Readings in coarse steps may not differ at all: then the step tells how far they may be off.
Correlated noise shows in the autocovariance. A first-order process beside white noise, a ripple, is an
ARMA(1, 1) process (Granger and Morris 1976), which a filter turns into white noise.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import chi2

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

STEEPEST_DECAY = 2.0
"""Largest ratio of autocovariances at successive readings [1]: what decays faster counts as white."""

SEEN = 3.0
"""Autocorrelation that is no chance, in standard deviations of that of white noise [1]."""

LEAST = 1e-4
"""Least floor [1], for recordings without noise: a hundredth of the noise that is stated."""


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
    return np.diff(readings, order) / np.sqrt(math.comb(2 * order, order))


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


def is_white(residual: NDArray, length: int) -> bool:
    """Whether block means scatter no more than independent samples of the same spread allow.

    The spread is read off differences between neighbours, which slow courses hardly enter.

    length: of a block [samples].
    """
    length = min(max(2, length), len(residual))
    blocks = residual[: len(residual) // length * length].reshape(-1, length)
    variance = np.mean(differences(residual, 1) ** 2)
    statistic = length * np.sum(np.mean(blocks, axis=1) ** 2)
    return bool(statistic <= variance * chi2.isf(1e-4, len(blocks)))


def autocovariance(readings: Sequence[NDArray]) -> NDArray:
    """Mean products of readings by lag [1], (lags,), pooled over runs; per run (readings,) [1]."""
    longest = max(2, int(0.5 * max(len(own) for own in readings)))  # beyond, there are few pairs
    total, count = np.zeros(longest + 1), np.zeros(longest + 1)
    for own in readings:
        size = 1 << int(np.ceil(np.log2(2 * len(own))))
        spectrum = np.abs(np.fft.rfft(own, size)) ** 2
        products = np.fft.irfft(spectrum, size)[: min(len(own), longest + 1)]
        total[: len(products)] += products
        count[: len(products)] += len(own) - np.arange(len(products))
    return total / np.maximum(count, 1)


def white_variance(covariance: NDArray) -> float:
    """Variance of the white part [1]: what the first lags, continued to lag 0, do not reach.

    A course that decays faster than STEEPEST_DECAY cannot be told from white noise.

    covariance: by lag, (at least 3,) [1].
    """
    variance, first, second = (float(value) for value in covariance[:3])
    if first <= 0:
        return variance
    ratio = min(max(first / second, 1.0), STEEPEST_DECAY) if second > 0 else STEEPEST_DECAY
    return max(variance - ratio * first, 0.5 * max(variance - first, 0.0), LEAST)


def correlated_readings(covariance: NDArray) -> float:
    """Readings that tell as much as one independent reading [1], by their autocovariance (lags,).

    1 + twice the sum of autocorrelations up to the first small one (Geyer 1992).
    """
    if covariance[0] <= 0:
        return 1.0
    correlation = covariance[1:] / covariance[0]
    small = np.flatnonzero(correlation < 0.05)
    kept = correlation[: small[0]] if len(small) else correlation
    return float(1.0 + 2.0 * np.sum(kept))


def faintly_correlated_readings(readings: Sequence[NDArray], mean_square: float) -> float:
    """The same by means of blocks (Alexopoulos and Seila 1998): a faint correlation may last long [1].

    Rounding to coarse steps leaves one: the same error as long as the reading does not move. The largest
    of several lengths of block, each less its chance.
    """
    found, length = 1.0, BLOCK_READINGS
    while mean_square > 0:
        means = [float(np.mean(part)) for own in readings for part in _whole_blocks(own, length)]
        if len(means) < 40:
            break
        chance = 1.0 + SEEN * np.sqrt(2.0 / len(means))
        found = max(found, float(length * np.mean(np.square(means)) / (mean_square * chance)))
        length *= 2
    return found


def _whole_blocks(readings: NDArray, length: int) -> list[NDArray]:
    """Parts of readings of at least this length; none of fewer readings."""
    return np.array_split(readings, len(readings) // length) if len(readings) >= length else []


@dataclass(frozen=True, kw_only=True)
class Ripple:
    """A first-order process beside white noise, as an ARMA(1, 1) process (Granger and Morris 1976)."""

    decay: float
    """Autocorrelation of the process at two successive samples [1]."""
    memory: float
    """Coefficient of the former innovation in a reading [1]."""
    noise: float
    """Standard deviation of the innovations, what no former reading predicts [noise deviations]."""
    sd: float
    """Standard deviation of the process [noise deviations]."""

    @classmethod
    def of(cls, variance: float, white: float, decay: float) -> "Ripple":
        """A process and white noise of these variances [noise variances]."""
        sides = variance * (1.0 - decay**2) + white * (1.0 + decay**2)
        product = white * decay
        half = 0.5 * sides
        innovations = half + math.sqrt(max(half**2 - product**2, 0.0))
        return cls(decay=decay, memory=product / innovations, noise=math.sqrt(innovations),
                   sd=math.sqrt(variance))  # fmt: skip

    @property
    def samples(self) -> float:
        """Samples over which the process is correlated."""
        return -1.0 / math.log(self.decay)

    def whitened(self, series: NDArray) -> NDArray:
        """Innovations of series (samples, ...) that were 0 before, in standard deviations of theirs."""
        return np.asarray(lfilter([1.0, -self.decay], [1.0, -self.memory], series / self.noise, axis=0))


def ripple(readings: Sequence[NDArray], correlated: float, mean_square: float) -> Ripple | None:
    """A first-order process in the quieter blocks that is as large in all of them; None for none.

    Whether a model of the inputs could predict it is asked elsewhere.
    """
    # Ten correlated readings: the mean square of a block must not scatter much.
    length = max(BLOCK_READINGS, round(10.0 * correlated))
    blocks = [part for own in readings for part in _whole_blocks(own, length)]
    blocks.sort(key=lambda part: float(np.mean(part**2)))
    if len(blocks) < 8:
        return None
    quiet = blocks[: round(0.75 * len(blocks))]  # a wrong form is in the others
    covariance = autocovariance(quiet)
    chance = SEEN * covariance[0] / np.sqrt(sum(len(part) for part in quiet))
    if covariance[1] < chance or covariance[0] < 0.6 * mean_square:
        return None
    small = np.flatnonzero(covariance[:-1] < max(chance, 0.2 * covariance[1]))
    last = int(small[0]) if len(small) else len(covariance) - 1
    early, late = covariance[1:last], covariance[2 : last + 1]
    decay = float(np.clip(early @ late / (early @ early), 0.0, 0.999))
    # What is fainter hardly moves the weights of the readings.
    if decay < 1.0 / STEEPEST_DECAY or covariance[1] < 0.2 * covariance[0]:
        return None
    rippling = min(float(covariance[1]) / decay, float(covariance[0]))
    return Ripple.of(rippling, float(covariance[0]) - rippling, decay)
