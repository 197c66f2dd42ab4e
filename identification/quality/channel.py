"""One channel of a steady recording, in A, V or bar: trend (Table 2), statistics (Table 3) and steps."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from epv_env.plant.channels import Sensor
from identification.noise import quantisation_step, rounding_error
from identification.recordings.plausibility import longest_run
from identification.recordings.recording import UNITS

DRIFT_LEVELS = (0.1, 1.0)
"""Drift over the record, relative to Table 1's accuracy, from which it is in doubt, and bad."""
LEAST_DITHER = 0.3
"""Noise in converter steps below which rounding errors no longer average out."""
SIGNIFICANCE = 1e-4
"""Probability that the longest run of equal readings of a live channel is taken for a dead one."""


@dataclass(frozen=True, kw_only=True)
class DescriptiveStatistics:
    """Central, dispersion and distribution properties of a detrended signal y (Table 3).

    A signal that never changes has no outlier factor, kurtosis or skewness: they are NaN.
    """

    arithmetic_mean: float
    """Sum of y over n [unit]; zero but for rounding, since the line was taken off."""
    trimmed_mean: float
    """Mean without the greatest and the least 2.5 %, 5 % in all [unit]."""
    median: float
    """Value with as many samples above as below [unit]."""
    standard_deviation: float
    """sigma: root of the sum of squares about the mean over n - 1 [unit]."""
    interquartile_range: float
    """From the 25 % to the 75 % quantile; 1.349 sigma for a normal signal [unit]."""
    absolute_deviation: float
    """Mean of |y - mean(y)|; 0.798 sigma for a normal signal [unit]."""
    range: float
    """Greatest minus least value [unit]."""
    signal_to_noise: float
    """20 log10(greatest value of the channel's range / sigma) (eq. 17) [dB]."""
    outlier_factor: float
    """Greatest |y - mean(y)| over sigma (eq. 18)."""
    kurtosis: float
    """Fourth moment about the mean over the squared variance; 3 for a normal signal."""
    skewness: float
    """Third moment about the mean over sigma cubed; 0 for a symmetric signal."""


def descriptive_statistics(residual: NDArray, *, greatest: float) -> DescriptiveStatistics:
    """Table 3's statistics of a detrended signal, (samples,).

    greatest: greatest value of the channel's range (Table 1), max(y) in eq. 17 [unit].
    """
    sigma = float(np.std(residual, ddof=1))
    moves = np.ptp(residual) > 0
    return DescriptiveStatistics(
        arithmetic_mean=float(np.mean(residual)),
        trimmed_mean=float(stats.trim_mean(residual, 0.025)),
        median=float(np.median(residual)),
        standard_deviation=sigma,
        interquartile_range=float(stats.iqr(residual)),
        absolute_deviation=float(np.mean(np.abs(residual - np.mean(residual)))),
        range=float(np.ptp(residual)),
        signal_to_noise=float(20 * np.log10(greatest / sigma)) if moves else np.inf,
        outlier_factor=float(np.max(np.abs(residual - np.mean(residual))) / sigma) if moves else np.nan,
        kurtosis=float(stats.kurtosis(residual, fisher=False)) if moves else np.nan,
        skewness=float(stats.skew(residual)) if moves else np.nan,
    )


def run_limit(readings: NDArray, rounding: float) -> int:
    """Length that runs of independent readings, (samples,), reach with a small probability [samples].

    A run of L readings starts at one of n samples with probability p^L, so the limit solves
    n p^L = SIGNIFICANCE. p is the share of the commonest reading, or what normal noise about that
    reading gives it if that is more, as under a drift. rounding: step over sigma. The limit is n for
    readings that never change, and at most n.
    """
    samples = len(readings)
    share = np.max(np.unique(readings, return_counts=True)[1]) / samples
    share = max(share, 1 - 2 * stats.norm.sf(rounding / 2))
    if share == 1.0:
        return samples
    return min(samples, int(np.ceil(np.log(SIGNIFICANCE / samples) / np.log(share))))


@dataclass(frozen=True, kw_only=True)
class ChannelAssessment:
    """One channel's readings and what they show."""

    name: str
    """One of recording.CHANNELS."""
    readings: NDArray
    """(samples,) [A, V or bar]."""
    residual: NDArray
    """Readings minus the line of the trend, (samples,) [A, V or bar]."""
    duration: float
    """Of the record [s]."""
    rest: float
    """What a perfect sensor reads with the coil off and the chambers vented [A, V or bar]."""
    trend: Any
    """The line through the readings by least squares (Table 2), from `scipy.stats.linregress`, with
    standard errors for white noise [unit, unit/s]."""
    description: DescriptiveStatistics
    quantum: float
    """Step of the readings: as they show it, otherwise as the campaign does; 0.0 without a grid."""
    sensor: Sensor
    """Range, accuracy and noise that it should have; Table 1's and Table 3's on the report's bench."""

    @property
    def unit(self) -> str:
        """A, V or bar."""
        return UNITS[self.name][0]

    @property
    def moves(self) -> bool:
        """Whether the reading changes at all."""
        return bool(np.ptp(self.readings) > 0)

    @property
    def offset(self) -> float:
        """Mean reading minus rest value [unit]; an offset error only if the record is at rest."""
        return float(np.mean(self.readings)) - self.rest

    @property
    def drift(self) -> float:
        """Change of the line over the record [unit]."""
        return float(self.trend.slope) * self.duration

    @property
    def within_accuracy(self) -> bool:
        """Whether the line stays within the accuracy of the rest value from start to end."""
        return abs(self.offset) + abs(self.drift) / 2 <= self.sensor.margin

    @property
    def at_rest(self) -> bool:
        """Whether the channel is steady, and within the accuracy of its rest value."""
        return self.within_accuracy and abs(self.drift) < DRIFT_LEVELS[0] * self.sensor.margin

    @property
    def usual_noise(self) -> float:
        """Standard deviation of a good sensor's readings in these steps [unit]."""
        return math.hypot(self.sensor.noise, rounding_error(self.quantum))

    @property
    def dithered(self) -> bool:
        """Whether noise moves the readings across steps enough for rounding errors to average out."""
        least = math.hypot(LEAST_DITHER * self.quantum, rounding_error(self.quantum))
        return self.description.standard_deviation >= least

    @property
    def stands_still(self) -> tuple[int, int] | None:
        """Longest run of one reading and its limit [samples]; None if independent noise explains it."""
        longest = longest_run(np.diff(self.readings) == 0)[1] + 1
        limit = run_limit(self.readings, self.quantum / self.description.standard_deviation)
        return (longest, limit) if longest > limit else None


def assess_channel(
    name: str, readings: NDArray, *, period: float, rest: float, step: float, sensor: Sensor
) -> ChannelAssessment:
    """Statistics of one channel.

    Args:
        name: one of recording.CHANNELS.
        readings: (samples,) [A, V or bar].
        period: time between samples [s].
        rest: what a perfect sensor reads at rest [A, V or bar].
        step: of the readings, where a record that hardly moves cannot show it [A, V or bar].
        sensor: of the channel.
    """
    time = np.arange(len(readings)) * period
    trend: Any = stats.linregress(time, readings)
    line = trend.intercept + trend.slope * time
    residual = readings - line if np.ptp(readings) > 0 else np.zeros_like(readings)
    return ChannelAssessment(
        name=name,
        readings=readings,
        residual=residual,
        duration=len(readings) * period,
        rest=rest,
        trend=trend,
        description=descriptive_statistics(residual, greatest=sensor.high),
        quantum=quantisation_step([readings], fewest=1) or step,
        sensor=sensor,
    )
