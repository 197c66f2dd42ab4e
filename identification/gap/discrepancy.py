"""Noise and discrepancy of each channel, as the residual under the best hypothesis shows them.

Residual = sensor noise + what the causes explain + a discrepancy (Kennedy and O'Hagan 2001). The
discrepancy is a stationary process with its own amplitude and time scale in each channel. Both come from
the autocovariance of the residual; neither is asked for.

The noise that a plant states is estimated from few readings at rest, or is not known at all. An error
of some percent would look like a gap, or hide one. Half the mean square of differences (Rice 1984) over
one, two and four readings tells white noise from what changes slowly: white noise is the same over any
lag, a misfit or a ripple grows with the lag, and the law of its growth leads back to lag 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from identification.gap.plant import GreyBox

# Discrepancy from the autocovariance

LONGEST_CORRELATION = 0.5
"""Longest lag of the autocovariance, as a share of the longest run [1]: beyond, there are few pairs."""

STEEPEST_DECAY = 2.0
"""Largest ratio of the discrepancy's autocovariances at two successive readings [1]: a discrepancy that
decays faster counts as noise."""

LEAST_CORRELATION = 0.05
"""Autocorrelation below which the sum of autocorrelations ends [1]: what follows is chance."""

SEEN_AUTOCORRELATION = 3.0
"""Autocorrelation of successive readings from which a discrepancy is seen, in standard deviations of
that of white noise [1]."""

BLOCK_READINGS, BLOCK_CORRELATIONS = 20, 10.0
"""Fewest readings of a block of which the mean square is taken, and its length in correlated readings
[1]: its mean square must not scatter much."""

FEWEST_BLOCKS, FEWEST_MEANS = 8, 40
"""Fewest blocks in all runs of which a quantile is taken, and whose means show a faint correlation."""

QUIET_SHARE = 0.25
"""Quantile of the blocks' mean squares that counts as quiet [1]: a wrong form shows in motion only,
noise and disturbances are always there."""

DISTURBED_FLOOR, DISTURBED_SHARE = 2.0, 0.6
"""A disturbance is there at all times where the quieter blocks' mean square exceeds this multiple of the
white variance and this share of the mean square [1]."""

LEAST_FLOOR_SHARE = 1e-6
"""Least floor as a share of the mean square [1], for recordings without noise."""

LEAST = np.finfo(float).tiny
"""Mean square in place of none, for recordings without noise."""

# White noise from differences

LAGS = (1, 2, 4)
"""Lags of the differences [readings]: doubled twice, so that their growth shows its law."""

JUMP_LIMIT, JUMP_ITERATIONS = 4.0, 20
"""Difference of consecutive residuals beyond which it is a jump of the misfit [standard deviations], and
most iterations of that limit, which usually settles earlier."""

MEDIAN_TO_SD = 1.4826
"""Standard deviation of a normal distribution over the median of its absolute values."""

WHITE_NOISE_TOLERANCE, WHITE_NOISE_DEVIATIONS = 0.1, 3.0
"""Growth of squared differences, from one to four readings, up to which the residual is taken for white:
relative [1], and in standard deviations of the growth where the readings tell less."""

LEAST_SLOW_GROWTH = 1.0
"""Growth from two to four readings, relative to that from one to two [1], from which a slow course lies
over white noise: a rough course has 2, noise correlated over two readings 0.5."""

LEAST_WHITE_SHARE = 0.5
"""Share of white noise in the squared differences of neighbours [1] below which it is not told from what
else changes."""


Series = tuple[NDArray, NDArray, float]
"""Residuals (samples,) [noise deviations], where they count (samples,), and the sampling period [s]."""


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


def channel_discrepancies(plant: GreyBox, residuals: Sequence[NDArray]) -> list[ChannelDiscrepancy]:
    """Noise and discrepancy by channel, from the residuals of the best hypothesis.

    residuals: per run (channels, samples) [noise deviations], 0 at untrusted readings.
    """
    found = []
    for c in range(len(plant.channels)):
        series = [
            (residual[c], run.trusted[c], float(run.time[1] - run.time[0]))
            for residual, run in zip(residuals, plant.runs, strict=True)
        ]
        found.append(_discrepancy(series))
    return found


def _discrepancy(series: Sequence[Series]) -> ChannelDiscrepancy:
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
    covariance = autocovariance(readings)
    correlated, mean_square = _inflation(covariance), float(covariance[0])
    # White noise of n readings has autocorrelations of 1/sqrt(n): less is no discrepancy.
    chance = SEEN_AUTOCORRELATION * mean_square / np.sqrt(count)
    coloured = covariance[1] > chance
    white = white_variance(covariance) if coloured else mean_square
    quiet = _quiet_mean_square(readings, correlated)
    disturbed = (
        quiet is not None and quiet > DISTURBED_FLOOR * white and quiet > DISTURBED_SHARE * mean_square
    )
    sd, time_scale = _coloured_part(series, mean_square, white, correlated)
    return ChannelDiscrepancy(
        readings=count,
        mean_square=mean_square,
        floor=max(
            min(quiet if disturbed and quiet else white, mean_square),
            LEAST_FLOOR_SHARE * mean_square,
            LEAST,
        ),
        inflation=correlated if disturbed else 1.0,
        autocorrelation=max(correlated, _faint_inflation(readings, mean_square)),
        sd=sd,
        time_scale=time_scale,
    )


def _coloured_part(
    series: Sequence[Series], mean_square: float, white: float, correlated: float
) -> tuple[float, float]:
    """Standard deviation [noise deviations] and time scale [s] of what is not white; 0 where unseen.

    mean_square: of all residuals [1]. white: variance of the white part [1]. correlated: `_inflation`.
    """
    coloured = mean_square - white
    if coloured <= 0.0:
        return 0.0, 0.0
    counts = [np.count_nonzero(trusted) for _, trusted, _ in series]
    # Readings may be sparser than samples.
    durations = [len(trusted) * period for _, trusted, period in series]
    period = float(sum(durations) / sum(counts))
    return float(np.sqrt(coloured)), 0.5 * (correlated - 1.0) * mean_square / coloured * period


def autocovariance(readings: Sequence[NDArray]) -> NDArray:
    """Mean products of readings by lag [1], (lags,), pooled over runs.

    readings: per run (readings,) [1].
    """
    longest = max(2, int(LONGEST_CORRELATION * max(len(own) for own in readings)))
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


def _inflation(covariance: NDArray) -> float:
    """1 + twice the sum of autocorrelations up to the first small one [1] (Geyer 1992)."""
    if covariance[0] <= 0:
        return 1.0
    correlation = covariance[1:] / covariance[0]
    small = np.flatnonzero(correlation < LEAST_CORRELATION)
    kept = correlation[: small[0]] if len(small) else correlation
    return float(1.0 + 2.0 * np.sum(kept))


def _faint_inflation(readings: Sequence[NDArray], mean_square: float) -> float:
    """The same by means of blocks (Alexopoulos and Seila 1998): a faint correlation may last long [1].

    Rounding to coarse steps leaves one: the same error as long as the reading does not move. The largest
    of several lengths of block, each less its chance.
    """
    found, length = 1.0, BLOCK_READINGS
    while mean_square > 0:
        means = [float(np.mean(part)) for part in _blocks(readings, length)]
        if len(means) < FEWEST_MEANS:
            break
        chance = 1.0 + SEEN_AUTOCORRELATION * np.sqrt(2.0 / len(means))
        found = max(found, float(length * np.mean(np.square(means)) / (mean_square * chance)))
        length *= 2
    return found


def _quiet_mean_square(readings: Sequence[NDArray], inflation: float) -> float | None:
    """Mean square of the quieter blocks [1]: a disturbance is in all of them, a wrong form is not.

    A quantile of the blocks' mean squares, less its bias. None where residuals are correlated for so
    long that the runs have too few blocks.
    """
    length = max(BLOCK_READINGS, round(BLOCK_CORRELATIONS * inflation))
    blocks = [float(np.mean(part**2)) for part in _blocks(readings, length)]
    if len(blocks) < FEWEST_BLOCKS:
        return None
    freedom = max(length / inflation, 1.0)
    return float(np.quantile(blocks, QUIET_SHARE) / (chi2.ppf(QUIET_SHARE, freedom) / freedom))


def _blocks(readings: Sequence[NDArray], length: int) -> list[NDArray]:
    """Parts of at least this length, of every run that is as long."""
    return [
        part
        for own in readings
        if len(own) >= length
        for part in np.array_split(own, len(own) // length)
    ]


def squared_differences(
    plant: GreyBox, residuals: Sequence[NDArray], lag: int
) -> tuple[list[NDArray], list[NDArray]]:
    """Squared differences of trusted residuals, and where they count, at the later sample.

    Samples that are not trusted are passed over: channels may have different sampling periods.

    Args:
        plant: the plant with its recordings.
        residuals: per run (channels, samples) [noise deviations].
        lag: number of trusted readings from the earlier to the later one.

    Returns:
        Squares [noise variances] and boolean masks, per run (channels, samples) each.
    """
    found = [
        _differences(residual, run.trusted, lag)
        for residual, run in zip(residuals, plant.runs, strict=True)
    ]
    changes, pairs = [change for change, _ in found], [pair for _, pair in found]
    together = np.concatenate(changes, axis=1), np.concatenate(pairs, axis=1)
    limits = np.array([_jump_limit(change[pair]) for change, pair in zip(*together, strict=True)])
    kept = [
        pair & (np.abs(change) <= limits[:, None]) for change, pair in zip(changes, pairs, strict=True)
    ]
    return [keep * change**2 for keep, change in zip(kept, changes, strict=True)], kept


def noise_ratios(variograms: NDArray, squares: NDArray) -> NDArray:
    """Noise standard deviation relative to the channel's, (draws, channels) [1]; row 0 is the estimate.

    The white part of the residual is the noise. Where it is not the larger part of what changes from one
    reading to the next, the noise itself is coloured: the ratio is 1, but no more than all that is left.

    Args:
        variograms: half the mean squared differences of the best model's residuals over LAGS, (lags,
            draws, channels) [noise variances].
        squares: mean squares of these residuals, (draws, channels) [noise variances].
    """
    first, fourth = variograms[0], variograms[-1]
    growth = fourth / np.maximum(first, np.finfo(float).tiny) - 1.0
    allowed = np.maximum(WHITE_NOISE_TOLERANCE, WHITE_NOISE_DEVIATIONS * np.std(growth, axis=0))
    white = np.abs(growth[0]) <= allowed
    law, at_zero = _at_lag_zero(variograms)
    slow = (law[0] >= LEAST_SLOW_GROWTH) & (at_zero[0] >= LEAST_WHITE_SHARE * first[0])
    stated = np.where(squares > 0, np.minimum(1.0, np.sqrt(squares)), 1.0)
    seen = np.sqrt(np.maximum(np.where(white, first, at_zero), 0.0))
    seen = np.where(seen > 0, seen, stated)
    return np.where((white | slow) & (first[0] > 0), seen, stated)


def _at_lag_zero(variograms: NDArray) -> tuple[NDArray, NDArray]:
    """Law of the growth, and the variogram without what grows, (draws, channels) each [1, variances].

    Noise plus b lag^p grows 2^p times as much from two to four readings as from one to two: twice for a
    rough course (p = 1), four times for a smooth one (p = 2), less than once for noise that is itself
    correlated over two readings. variograms: (lags, draws, channels) [noise variances].
    """
    first, second, fourth = variograms
    early = np.maximum(second - first, np.finfo(float).tiny)
    law = (fourth - second) / early
    return law, first - early / (np.clip(law, 2.0, 4.0) - 1.0)


def _differences(residual: NDArray, trusted: NDArray, lag: int) -> tuple[NDArray, NDArray]:
    """Differences over `lag` trusted readings, and whether a sample has one, (channels, samples) each.

    residual: (channels, samples) [noise deviations]. trusted: boolean (channels, samples).
    """
    changes, pairs = np.zeros(residual.shape), np.zeros(residual.shape, dtype=bool)
    for change, pair, own, counted in zip(changes, pairs, residual, trusted, strict=True):
        places = np.flatnonzero(counted)
        change[places[lag:]] = own[places[lag:]] - own[places[:-lag]]
        pair[places[lag:]] = True
    return changes, pairs


def _jump_limit(changes: NDArray) -> float:
    """Largest difference that is no jump, from the standard deviation of those below the limit.

    changes: (differences,) [noise deviations].
    """
    median = float(np.median(np.abs(changes))) if len(changes) else 0.0
    limit = JUMP_LIMIT * MEDIAN_TO_SD * median
    for _ in range(JUMP_ITERATIONS):
        kept = changes[np.abs(changes) <= limit]
        if not len(kept):
            return np.inf
        limit = JUMP_LIMIT * float(np.sqrt(np.mean(kept**2)))
    return limit
