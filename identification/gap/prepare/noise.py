"""The noise of a channel: white or in steps in its raw readings, with a ripple in what a model leaves.

What the best model leaves is noise too, as long as it is no larger than the raw readings allow. A
ripple is in all parts of the residual, a wrong form shows in motion only. Readings, outputs and
derivatives pass its filter alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.plant import Channel, GreyBox, PlantError
from identification.noise import (
    LEAST,
    SEEN,
    Ripple,
    autocovariance,
    correlated_readings,
    faintly_correlated_readings,
    quantisation_step,
    ripple,
    rounding_error,
    white_noise,
    white_variance,
)

RAW_TOLERANCE = 1.05
"""Noise that a residual shows over that of the raw readings [1], up to which both agree."""

CANCELLED = 0.01
"""Share of the mean square below which the lags hold no white part but rounding [1]: neighbours do."""


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
    own = ripples[channel] if ripples else None
    return max(ratio / own.noise, 1.0) if own else ratio


def _channel_noise(series: Sequence[NDArray], duration: float, raw: float) -> ChannelNoise:
    """duration: of all runs [s]. raw: of `raw_noise_ratio`."""
    readings = [own for own in series if len(own)]
    count = sum(len(own) for own in readings)
    if count < 3:
        return ChannelNoise(
            readings=count, floor=1.0, correlated=1.0, sd=0.0, time_scale=0.0, ripple=None
        )
    covariance = autocovariance(readings)
    mean_square, correlated = float(covariance[0]), correlated_readings(covariance)
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
        correlated=max(correlated, faintly_correlated_readings(readings, mean_square)),
        sd=float(np.sqrt(beside)),
        time_scale=0.5 * (correlated - 1.0) * mean_square / beside * period if beside else 0.0,
        ripple=ripple(readings, correlated, mean_square) if coloured else None,
    )
