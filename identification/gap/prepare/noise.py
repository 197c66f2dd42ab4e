"""The noise of a channel: white or in steps in its raw readings, with a ripple in what a model leaves.

What the best model leaves is noise too, as long as it is no larger than the raw readings allow. A
ripple is in all parts of the residual, a wrong form shows in motion only. Ripple and white noise
together are an ARMA(1, 1) process (Granger and Morris 1976), which a filter turns into white noise:
readings, outputs and derivatives pass it alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.plant import Channel, GreyBox, PlantError, Ripple
from identification.readings_noise import (
    BLOCK_READINGS,
    quantisation_step,
    rounding_error,
    white_noise,
)

STEEPEST_DECAY = 2.0
"""Largest ratio of autocovariances at successive readings [1]: what decays faster counts as white."""

SEEN = 3.0
"""Autocorrelation that is no chance, in standard deviations of that of white noise [1]."""

RAW_TOLERANCE = 1.05
"""Noise that a residual shows over that of the raw readings [1], up to which both agree."""

CANCELLED = 0.01
"""Share of the mean square below which the lags hold no white part but rounding [1]: neighbours do."""

LEAST = 1e-4
"""Least floor [1], for recordings without noise: a hundredth of the noise that is stated."""


def channel_noise(channel: Channel, series: Sequence[NDArray]) -> float:
    """Noise of a channel [SI]: as given or as its readings show it, at least the error of rounding.

    series: trusted readings of each run, (readings,) [SI]. Raises PlantError where noise is neither
    given nor seen.
    """
    if channel.noise is not None:
        return max(channel.noise, rounding_error(channel.resolution))
    floor = rounding_error(channel.resolution or quantisation_step(series))
    level = white_noise(series)
    if level > floor:
        return level
    if not floor > 0:
        raise PlantError(
            f"channel {channel.name}: its noise is None, but its trusted readings do not show any "
            "(too few, or most neighbours are equal): give `noise` or `resolution`"
        )
    return floor


@dataclass(frozen=True, kw_only=True)
class ChannelNoise:
    """What the best model leaves of one channel; deviations in units of `Channel.noise`."""

    readings: int
    """Number of trusted readings."""
    floor: float
    """Mean square that no cause can remove [1]."""
    correlated: float
    """Readings of what remains that tell as much as one independent reading [1]; 1 for white noise."""
    sd: float
    """Standard deviation of what remains beside white noise [noise deviations]; 0 where none is seen."""
    time_scale: float
    """Integral of its autocorrelation over positive lags [s]; 0 where `sd` is 0."""
    ripple: Ripple | None
    """A ripple that is there at all times; None where none is seen."""


def residual_noise(plant: GreyBox, residuals: Sequence[NDArray]) -> list[ChannelNoise]:
    """Noise by channel, from the residuals of the best hypothesis.

    residuals: per run (channels, samples) [noise deviations], 0 at untrusted readings.
    """
    durations = sum(len(run.time) * float(run.time[1] - run.time[0]) for run in plant.runs)
    return [
        _channel_noise(
            [r[c][run.trusted[c]] for r, run in zip(residuals, plant.runs, strict=True)],
            durations,
            raw_noise_ratio(plant, c),
        )
        for c in range(len(plant.channels))
    ]


def raw_noise_ratio(plant: GreyBox, channel: int) -> float:
    """Largest noise that raw readings, or who states it, allow, over the channel's [1]."""
    series = [run.measured[channel][run.trusted[channel]] for run in plant.runs]
    seen = np.nan_to_num(white_noise(series))
    ratio = max(float(seen) / plant.channels[channel].known_noise, 1.0)
    ripples = getattr(plant, "ripples", ())
    ripple = ripples[channel] if ripples else None
    return max(ratio / ripple.noise, 1.0) if ripple else ratio


def _channel_noise(series: Sequence[NDArray], duration: float, raw: float) -> ChannelNoise:
    """duration: of all runs [s]. raw: of `raw_noise_ratio`."""
    readings = [own for own in series if len(own)]
    count = sum(len(own) for own in readings)
    if count < 3:
        return ChannelNoise(
            readings=count, floor=1.0, correlated=1.0, sd=0.0, time_scale=0.0, ripple=None
        )
    covariance = autocovariance(readings)
    mean_square, correlated = float(covariance[0]), _correlated(covariance)
    coloured = covariance[1] > SEEN * mean_square / np.sqrt(count)
    neighbours = float(np.nan_to_num(white_noise(readings)) ** 2)
    white = white_variance(covariance) if coloured else mean_square
    if neighbours < CANCELLED * mean_square:
        white = max(white, neighbours)
    beside = max(mean_square - white, 0.0)
    period = duration / count  # readings may be sparser than samples
    return ChannelNoise(
        readings=count,
        floor=max(min(white, (RAW_TOLERANCE * raw) ** 2), LEAST),
        correlated=max(correlated, _faintly_correlated(readings, mean_square)),
        sd=float(np.sqrt(beside)),
        time_scale=0.5 * (correlated - 1.0) * mean_square / beside * period if beside else 0.0,
        ripple=_ripple(readings, correlated, mean_square) if coloured else None,
    )


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


def _correlated(covariance: NDArray) -> float:
    """1 + twice the sum of autocorrelations up to the first small one [1] (Geyer 1992)."""
    if covariance[0] <= 0:
        return 1.0
    correlation = covariance[1:] / covariance[0]
    small = np.flatnonzero(correlation < 0.05)
    kept = correlation[: small[0]] if len(small) else correlation
    return float(1.0 + 2.0 * np.sum(kept))


def _faintly_correlated(readings: Sequence[NDArray], mean_square: float) -> float:
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


def _ripple(readings: Sequence[NDArray], correlated: float, mean_square: float) -> Ripple | None:
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
