"""One uniform grid of times for the channels of a recording, without delay or aliases.

Channels of other rates and jittering times are resampled in three steps. A cubic spline through the
samples at their true times gives values on a fine uniform grid; it takes jitter out. A symmetric
low-pass (Kaiser window) on the fine grid removes what the lower of both rates cannot carry; being
symmetric about each sample it delays nothing. Every n-th value is kept. What goes in steps would ring:
the coil's voltage and other commands are held from one entry to the next instead.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import firwin, kaiserord, oaconvolve

from identification.importing.channels import COMMANDS, MappedChannel
from identification.importing.source_file import ImportingError
from identification.recordings.columns import LEAST_RATE, last_digit, roundest

MOST_STEP = 1.75
"""Longest step over the usual one. A missing sample makes 2; jitter of a third of a period, 1.67."""
RESAMPLING_MARGIN = 4
"""Least density of the fine grid over a channel's own rate: the spline is smooth on it."""
PASSBAND = 0.35
"""End of the passband over the lower of both rates; the switching of the coil stays sharp."""
STOPBAND = 0.5
"""Begin of the stopband over the lower of both rates: from Nyquist's frequency on nothing folds."""
STOP_ATTENUATION = 70.0
"""Attenuation of what would fold [dB]: below a step of 12 bits."""
SAME_TIME = 1e-2
"""Part of a period by which times may differ and count as the same samples. At 2 kHz these are 5 µs, in
which the steepest pressure changes by less than its noise."""
LEAST_STEP = 0.1
"""Least change over the range of a channel that goes in steps; what is measured changes by less."""
GREATEST_RATE = 20_000.0
"""Greatest rate of a campaign [1/s]; a faster bench is brought down to it. Valve and sensors are
slower, and longer files only cost time."""


@dataclass(frozen=True, kw_only=True)
class GriddedSignals:
    """The channels of a recording on common times."""

    period: float
    """Between samples [s]."""
    signals: Mapping[str, NDArray]
    """By channel, each (samples,) [SI]."""
    resampled: tuple[str, ...]
    """Channels that were filtered: their samples are not the file's own."""
    held: tuple[str, ...]
    """Channels of which each sample is the file's last entry before it."""


def on_common_grid(
    place: str, channels: Sequence[MappedChannel], rate: float | None = None
) -> GriddedSignals:
    """The channels on one uniform grid; samples that lie on it already are left as they are.

    Args:
        place: begins the messages.
        channels: of one recording.
        rate: wanted samples per second [1/s]; None: the slowest channel's.

    Raises ImportingError for times with gaps, out of order or too slow.
    """
    for channel in channels:
        _check_times(f"{place}, {channel.source.name}", channel)
    channels = [_on_its_grid(channel) for channel in channels]
    sampled = [channel for channel in channels if not _is_logged_on_change(channel)]
    periods = [
        channel.period or 1.0 / max(round(usual_rate(channel.time)), LEAST_RATE)
        for channel in sampled
        if channel.name != "sigma_S"
    ]
    period = max(*periods, 1.0 / GREATEST_RATE) if rate is None else 1.0 / rate
    grid = _grid(place, channels, sampled, period)
    signals, changed, held = {}, [], []
    for channel in channels:
        first = _first_sample(channel, grid, period)
        if first is not None:
            signals[channel.name] = channel.values[first : first + len(grid)]
        elif channel.name == "U" or _goes_in_steps(channel.values):
            last = np.searchsorted(channel.time, grid + SAME_TIME * period, side="right") - 1
            signals[channel.name] = channel.values[last]
            held.append(channel.name)
        else:
            signals[channel.name] = resampled(channel.time, channel.values, grid)
            changed.append(channel.name)
    return GriddedSignals(period=period, signals=signals, resampled=tuple(changed), held=tuple(held))


def _on_its_grid(channel: MappedChannel) -> MappedChannel:
    """A channel with the grid of which its times are rounded; as it is if they jitter."""
    time = channel.time
    count, since = np.arange(len(time)), time - time[0]
    slope = float(np.polyfit(count, since, 1)[0])
    rounding = 0.5 * last_digit(since) + SAME_TIME * slope
    margin = 3.0 * rounding / len(time)  # errors of no more than the rounding turn the line by less
    for period in (roundest(slope - margin, slope + margin), slope):
        off = since - period * count
        if np.ptp(off) <= 2.0 * rounding:
            begin = float(time[0] + 0.5 * (np.min(off) + np.max(off)))
            return replace(channel, time=begin + period * count, period=period)
    return channel


def _goes_in_steps(values: NDArray) -> bool:
    """Whether values (samples,) only stay as they are or jump: a filter would make them ring."""
    change = np.abs(np.diff(values))
    return bool(np.all((change == 0.0) | (change > LEAST_STEP * np.ptp(values))))


def _is_logged_on_change(channel: MappedChannel) -> bool:
    """Whether the entries of a command are its changes, at most each with the values around it."""
    if channel.name not in COMMANDS or usual_rate(channel.time) >= LEAST_RATE:
        return False
    changes = np.diff(channel.values) != 0.0
    dense = not np.any(changes) or float(np.mean(changes)) >= 1.0 / 3.0  # a sampled one mostly stays
    return dense and _goes_in_steps(channel.values)


def _check_times(place: str, channel: MappedChannel) -> None:
    steps = np.diff(channel.time)
    backward = np.flatnonzero(steps <= 0)
    if backward.size:
        at, falls = channel.time[backward[0]], steps[backward[0]] < 0
        remedy = "cut the recording there, or sort its samples if they are out of order"
        remedy = remedy if falls else "print it with more digits"
        raise ImportingError(f"{place}: time does not increase after {at:.6g} s: {remedy}")
    if _is_logged_on_change(channel):
        return
    usual = float(np.median(steps))
    gap = np.flatnonzero(steps > MOST_STEP * usual)
    if gap.size:
        first, last = channel.time[gap[0]], channel.time[gap[0] + 1]
        absent = np.count_nonzero(~np.isfinite(channel.source.values))
        why = f", and {absent} readings are empty or marked invalid" if absent else ""
        remedy = "" if absent else ", or print the time with more digits"
        raise ImportingError(
            f"{place}: no samples from {first:.6g} to {last:.6g} s, where the usual step is {usual:.3g} "
            f"s{why}: cut the recording there, since a gap is not filled{remedy}"
        )
    if channel.name != "sigma_S" and usual * LEAST_RATE > 1.0 + 1e-3:
        raise ImportingError(
            f"{place}: sampled at {1 / usual:.4g} Hz: record at {LEAST_RATE:g} Hz or faster, or "
            "give the right unit of time in a mapping file"
        )


def _grid(
    place: str, channels: Sequence[MappedChannel], sampled: Sequence[MappedChannel], period: float
) -> NDArray:
    """Times within all channels, (samples,) [s], on the samples of a uniform channel if there is one."""
    start = max(float(channel.time[0]) for channel in channels)
    end = min(float(channel.time[-1]) for channel in sampled)
    for channel in sampled:
        if channel.period is not None and abs(channel.period / period - 1.0) < 1e-6:
            later = channel.time[channel.time >= start - SAME_TIME * period]
            start = float(later[0]) if later.size else start
            break
    count = int(np.floor((end - start) / period + 1e-2)) + 1
    if count < 2:
        raise ImportingError(f"{place}: its channels have no time in common: export them together")
    return start + period * np.arange(count)


def _first_sample(channel: MappedChannel, grid: NDArray, period: float) -> int | None:
    """The sample with which the grid begins, if the channel's samples are the grid's; else None."""
    if channel.period is None or abs(channel.period - period) * len(grid) > SAME_TIME * period:
        return None
    first = round((grid[0] - channel.time[0]) / channel.period)
    apart = channel.time[0] + first * channel.period - grid[0]
    fits = first >= 0 and first + len(grid) <= len(channel.time)
    return first if fits and abs(apart) <= SAME_TIME * period else None


def usual_rate(time: NDArray) -> float:
    """Samples per second of times (samples,) [s] that may jitter [1/s]."""
    return (len(time) - 1) / float(time[-1] - time[0])


def resampled(time: NDArray, values: NDArray, grid: NDArray) -> NDArray:
    """Values on a uniform grid, (grid,), in the unit of `values`.

    Args:
        time: of the samples, increasing, (samples,) [s]; it covers the grid.
        values: (samples,), any unit.
        grid: wanted times, uniform, (grid,) [s].
    """
    period = float(grid[-1] - grid[0]) / (len(grid) - 1)
    own = usual_rate(time)
    lower, dense = min(own, 1.0 / period), max(1, math.ceil(RESAMPLING_MARGIN * own * period))
    step = period / dense
    count, beta = kaiserord(STOP_ATTENUATION, 2.0 * (STOPBAND - PASSBAND) * lower * step)
    window: Any = ("kaiser", beta)
    taps = firwin(count | 1, 0.5 * (PASSBAND + STOPBAND) * lower, window=window, fs=1.0 / step)
    half = len(taps) // 2
    fine = grid[0] + np.arange(-half, dense * (len(grid) - 1) + half + 1) * step
    fine = time[0] + np.abs(fine - time[0])  # beyond the ends, where the filter looks: mirror images
    fine = np.clip(time[-1] - np.abs(time[-1] - fine), time[0], time[-1])
    return np.asarray(oaconvolve(CubicSpline(time, values)(fine), taps, mode="valid"))[::dense]
