"""Descriptive statistics of one steady signal (section 4.1), in any unit."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats


@dataclass(frozen=True, kw_only=True)
class Trend:
    """The straight line through a signal by linear least squares (Table 2)."""

    factor: float
    """Slope [unit/s]."""
    factor_error: float
    """Standard error of the slope, for white noise [unit/s]."""
    offset: float
    """Value of the line at time 0 [unit]."""
    offset_error: float
    """Standard error of the offset, for white noise [unit]."""

    def at(self, time: NDArray) -> NDArray:
        """The line [unit] at some times (times,) [s], (times,)."""
        return self.offset + self.factor * time


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


def fit_trend(time: NDArray, signal: NDArray) -> Trend:
    """Line through a signal (samples,) [unit] over time (samples,) [s]; at least three samples."""
    line: Any = stats.linregress(time, signal)
    return Trend(
        factor=float(line.slope),
        factor_error=float(line.stderr),
        offset=float(line.intercept),
        offset_error=float(line.intercept_stderr),
    )


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


def outlier_limit(
    samples: int, *, rounding: float, confidence: float = 0.999, hidden: float = 1.0
) -> float:
    """Outlier factor (eq. 18) that normal noise of n samples stays below with a given confidence.

    From the distribution of the greatest of n independent |y|/sigma, (2 Phi(z) - 1)^n = confidence.
    Rounding may move a reading outwards by half a step: `rounding` is the step over sigma. hidden: the
    noise before rounding over sigma, where coarse steps hide most of it; at least 1.
    """
    exceeds = -np.expm1(np.log(confidence) / samples)
    return float(hidden * stats.norm.isf(exceeds / 2) + rounding / 2)
