"""The time scale of a plant: how long its fastest motion lasts that the readings show.

The changes of a relaxation decay with its time constant, those of an oscillation with its period,
whatever the inputs do in between. So the time scale is the lag at which the autocorrelation of the
readings' changes falls below 1/e: the time constant, or a fifth of the period. Readings are averaged
over the narrowest width at which their changes stand out of the noise, and the noise's part of the
autocorrelation is subtracted. So white noise does not make a slow plant look fast.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate

from identification.gap.plant import GreyBox
from identification.readings_noise import white_noise

FEWEST_WIDTHS = 8
"""Fewest averaging widths that the shortest run must hold [1]: fewer show no course."""


def time_scale(plant: GreyBox) -> float:
    """Shortest time in which the plant's motion changes its course [s], at least one sampling period.

    Args:
        plant: its attribute `time_scale` [s] counts where it has one; else its readings do.

    Raises:
        ValueError: the plant's own time scale is not positive.
    """
    given = getattr(plant, "time_scale", None)
    if given is not None:
        if not (np.isfinite(given) and given > 0):
            raise ValueError(
                f"the plant's time_scale is {given}: give a positive time in s, or leave it out"
            )
        return float(given)
    period = min(float(run.time[1] - run.time[0]) for run in plant.runs)
    scales = [_channel_scale(plant, c) for c in range(len(plant.channels))]
    seen = [scale for scale in scales if scale is not None]
    # A plant that stands still: some hundred stretches tell chance from rule.
    still = 0.01 * min(float(run.time[-1] - run.time[0]) for run in plant.runs)
    return max(period, min(seen, default=still))


def _channel_scale(plant: GreyBox, channel: int) -> float | None:
    """Time scale of one channel [s]; None where it shows no motion.

    A channel that is read at every tenth sample only is taken at its own period.
    """
    series, spacings, period = [], [], 0.0
    for run in plant.runs:
        counted = np.flatnonzero(run.trusted[channel] & np.isfinite(run.measured[channel]))
        if len(counted) > FEWEST_WIDTHS:
            series.append(run.measured[channel, counted])
            spacings.append(np.diff(counted))
            period = max(period, float(run.time[1] - run.time[0]))
    if not series:
        return None
    noise = min(plant.channels[channel].known_noise, white_noise(series))
    lag = _correlation_lag(series, noise)
    return None if lag is None else lag * period * float(np.median(np.concatenate(spacings)))


def _correlation_lag(series: Sequence[NDArray], noise: float) -> float | None:
    """Lag at which the autocorrelation of the changes falls below 1/e [readings].

    None where the changes do not stand out of the noise. series: per run (readings,) [SI]. noise:
    standard deviation [SI].
    """
    width = _averaging_width(series, noise)
    if width is None:
        return None
    changes = [_changes(y, width) for y in series]
    longest = max(len(own) for own in changes)
    total = np.zeros(longest)
    for own in changes:
        total[: len(own)] += correlate(own, own)[len(own) - 1 :]
    lags = np.arange(longest)
    of_noise = noise**2 * (
        2 * _overlap(lags, width) - _overlap(lags - width, width) - _overlap(lags + width, width)
    )
    left = total - sum(len(own) for own in changes) * of_noise
    below = np.flatnonzero(left < left[0] / np.e)
    if left[0] <= 0 or not len(below):
        return None
    after = int(below[0])
    fraction = (left[after - 1] - left[0] / np.e) / (left[after - 1] - left[after])
    return float(after - 1 + fraction)


def _averaging_width(series: Sequence[NDArray], noise: float) -> int | None:
    """Narrowest width [readings] at which changes stand clearly out of the noise, or about as clearly
    as at any width; None where they never do."""
    widest = min(len(y) for y in series) // FEWEST_WIDTHS
    widths = [1]
    while widths[-1] < widest:
        widths.append(max(widths[-1] + 1, round(1.25 * widths[-1])))
    squares = [np.mean(np.concatenate([_changes(y, w) for y in series]) ** 2) for w in widths]
    # Readings that stand still without noise have neither.
    expected = np.maximum(2 * noise**2 / np.array(widths), np.finfo(float).tiny)
    clearness = np.array(squares) / expected
    # A hundred are enough even where the noise is three times as large as the plant says.
    enough = min(100.0, 0.5 * float(np.max(clearness)))
    if np.max(clearness) < 3.0:  # which noise reaches by chance
        return None
    return widths[int(np.argmax(clearness >= enough))]


def _changes(readings: NDArray, width: int) -> NDArray:
    """Differences of the means of adjacent stretches of `width` of the readings (readings,) [SI]."""
    sums = np.concatenate([[0.0], np.cumsum(readings - readings[0])])
    means = (sums[width:] - sums[:-width]) / width
    return means[width:] - means[:-width]


def _overlap(lags: NDArray, width: int) -> NDArray:
    """Correlation of two means over `width` readings of unit white noise, by their lag (lags,) [1]."""
    return np.maximum(0.0, 1.0 - np.abs(lags) / width) / width
