"""Noise and discrepancy of each channel: what remains of the residual under the best hypothesis.

Residual = sensor noise + what the causes explain + a discrepancy (Kennedy and O'Hagan 2001). The
discrepancy is a stationary process with its own amplitude and time scale in each channel. Both come from
the autocovariance of the residual; neither is asked for.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from identification.gap.model.grey_box import GreyBox
from identification.gap.rank.settings import RankingSettings


@dataclass(frozen=True, kw_only=True)
class ChannelDiscrepancy:
    """Noise and discrepancy of one channel; deviations and variances in units of `Channel.noise`."""

    readings: int
    """Number of trusted readings."""
    mean_square: float
    """Of the residual: noise and discrepancy [1]."""
    floor: float
    """Mean square that no cause can remove: noise, and disturbances that are there at all times [1]."""
    inflation: float
    """Readings at the floor that tell as much as one independent reading [1]; 1 for white noise."""
    autocorrelation: float
    """The same for all that remains: noise and discrepancy [1]."""
    sd: float
    """Standard deviation of the discrepancy [noise deviations]; 0 where nothing but noise is seen."""
    time_scale: float
    """Integral of the discrepancy's autocorrelation over positive lags [s]; 0 where `sd` is 0."""


def channel_discrepancies(
    plant: GreyBox, residuals: Sequence[NDArray], settings: RankingSettings
) -> list[ChannelDiscrepancy]:
    """Noise and discrepancy by channel, from the residuals of the best hypothesis.

    residuals: per run (channels, samples) [noise deviations], 0 at untrusted readings.
    """
    found = []
    for c in range(len(plant.channels)):
        series = [
            (residual[c], run.trusted[c], float(run.time[1] - run.time[0]))
            for residual, run in zip(residuals, plant.runs, strict=True)
        ]
        found.append(_discrepancy(series, settings))
    return found


LEAST = np.finfo(float).tiny
"""Mean square in place of none, for recordings without noise."""

Series = tuple[NDArray, NDArray, float]
"""Residuals (samples,) [noise deviations], where they count (samples,), and the sampling period [s]."""


def _discrepancy(series: Sequence[Series], settings: RankingSettings) -> ChannelDiscrepancy:
    readings = [residual[trusted] for residual, trusted, _ in series if np.any(trusted)]
    count = sum(len(own) for own in readings)
    if count < 3:
        return ChannelDiscrepancy(
            readings=count,
            mean_square=1.0,
            floor=1.0,
            inflation=1.0,
            autocorrelation=1.0,
            sd=0.0,
            time_scale=0.0,
        )
    covariance = autocovariance(readings, settings.longest_correlation)
    correlated, mean_square = _inflation(covariance, settings), float(covariance[0])
    # White noise of n readings has autocorrelations of 1/sqrt(n): less is no discrepancy.
    chance = settings.seen_autocorrelation * mean_square / np.sqrt(count)
    coloured = covariance[1] > chance
    white = white_variance(covariance, settings.steepest_decay) if coloured else mean_square
    quiet = _quiet_mean_square(readings, correlated, settings)
    disturbed = (
        quiet is not None
        and quiet > settings.disturbed_floor * white
        and quiet > settings.disturbed_share * mean_square
    )
    sd, time_scale = _coloured_part(series, mean_square, white, correlated)
    return ChannelDiscrepancy(
        readings=count,
        mean_square=mean_square,
        floor=max(
            min(quiet if disturbed and quiet else white, mean_square),
            settings.least_floor_share * mean_square,
            LEAST,
        ),
        inflation=correlated if disturbed else 1.0,
        autocorrelation=max(correlated, _faint_inflation(readings, mean_square, settings)),
        sd=sd,
        time_scale=time_scale,
    )


def _coloured_part(
    series: Sequence[Series], mean_square: float, white: float, correlated: float
) -> tuple[float, float]:
    """Standard deviation [noise deviations] and time scale [s] of what is not white; 0 where unseen.

    Args:
        series: of each run.
        mean_square: of all residuals [1].
        white: variance of the white part [1].
        correlated: sum of the autocorrelations, as `_inflation` has it [1].
    """
    coloured = mean_square - white
    if coloured <= 0.0:
        return 0.0, 0.0
    counts = [np.count_nonzero(trusted) for _, trusted, _ in series]
    # Readings may be sparser than samples.
    durations = [len(trusted) * period for _, trusted, period in series]
    period = float(sum(durations) / sum(counts))
    return float(np.sqrt(coloured)), 0.5 * (correlated - 1.0) * mean_square / coloured * period


def autocovariance(readings: Sequence[NDArray], longest_share: float) -> NDArray:
    """Mean products of readings by lag [1], (lags,), pooled over runs.

    readings: per run (readings,) [1]. longest_share: longest lag as a share of the longest run [1].
    """
    longest = max(2, int(longest_share * max(len(own) for own in readings)))
    total, count = np.zeros(longest + 1), np.zeros(longest + 1)
    for own in readings:
        if not len(own):
            continue
        size = 1 << int(np.ceil(np.log2(2 * len(own))))
        spectrum = np.abs(np.fft.rfft(own, size)) ** 2
        products = np.fft.irfft(spectrum, size)[: min(len(own), longest + 1)]
        total[: len(products)] += products
        count[: len(products)] += len(own) - np.arange(len(products))
    return total / np.maximum(count, 1)


def white_variance(covariance: NDArray, steepest: float) -> float:
    """Variance of the white part [1]: what the first lags, continued to lag 0, do not reach.

    Args:
        covariance: by lag, (at least 3,) [1].
        steepest: largest ratio of the coloured part at two successive lags [1]; a course that decays
            faster cannot be told from white noise.
    """
    variance, first, second = (float(value) for value in covariance[:3])
    if first <= 0:
        return variance
    ratio = min(max(first / second, 1.0), steepest) if second > 0 else steepest
    return max(variance - ratio * first, 0.5 * max(variance - first, 0.0), LEAST)


def _inflation(covariance: NDArray, settings: RankingSettings) -> float:
    """1 + twice the sum of autocorrelations up to the first small one [1] (Geyer 1992)."""
    if covariance[0] <= 0:
        return 1.0
    correlation = covariance[1:] / covariance[0]
    small = np.flatnonzero(correlation < settings.least_correlation)
    kept = correlation[: small[0]] if len(small) else correlation
    return float(1.0 + 2.0 * np.sum(kept))


def _faint_inflation(
    readings: Sequence[NDArray], mean_square: float, settings: RankingSettings
) -> float:
    """The same by means of blocks (Alexopoulos and Seila 1998): a faint correlation may last long [1].

    Rounding to coarse steps leaves one: the same error as long as the reading does not move. The largest
    of several lengths of block, each less its chance.
    """
    found, length = 1.0, settings.block_readings
    while mean_square > 0:
        means = [
            float(np.mean(part))
            for own in readings
            for part in np.array_split(own, max(1, len(own) // length))
            if len(own) >= length
        ]
        if len(means) < settings.fewest_means:
            break
        chance = 1.0 + settings.seen_autocorrelation * np.sqrt(2.0 / len(means))
        found = max(found, float(length * np.mean(np.square(means)) / (mean_square * chance)))
        length *= 2
    return found


def _quiet_mean_square(
    readings: Sequence[NDArray], inflation: float, settings: RankingSettings
) -> float | None:
    """Mean square of the quieter blocks [1]: a disturbance is in all of them, a wrong form is not.

    A quantile of the blocks' mean squares, less its bias. None where residuals are correlated for so
    long that the runs have too few blocks.
    """
    length = max(settings.block_readings, round(settings.block_correlations * inflation))
    blocks = [
        float(np.mean(part**2))
        for own in readings
        for part in np.array_split(own, max(1, len(own) // length))
        if len(own) >= length
    ]
    if len(blocks) < settings.fewest_blocks:
        return None
    freedom = max(length / inflation, 1.0)
    share = settings.quiet_share
    return float(np.quantile(blocks, share) / (chi2.ppf(share, freedom) / freedom))
