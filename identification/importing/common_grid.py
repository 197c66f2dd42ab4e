"""One uniform grid of times for the channels of a recording, without delay or aliases.

Channels of other rates and jittering times are resampled in three steps. A cubic spline through the
samples at their true times gives values on a fine uniform grid; it takes jitter out. A symmetric
low-pass (Kaiser window) on the fine grid removes what the lower of both rates cannot carry; being
symmetric about each sample it delays nothing. Every n-th value is kept. The coil's voltage would ring:
it is held from one entry to the next instead.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import firwin, kaiserord, oaconvolve

from identification.importing.channels import MappedChannel
from identification.importing.source_file import ImportingError
from identification.recordings.columns import LEAST_RATE, Place, last_digit, roundest
from identification.recordings.plausibility import longest_run
from identification.recordings.recording import UNITS
from identification.recordings.recording_checks import check_clipped

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
"""Least change over the range of a voltage that goes in steps; one that is measured changes by less."""
GREATEST_RATE = 20_000.0
"""Greatest rate of a campaign [1/s]; a faster bench is brought down to it. Valve and sensors are
slower, and longer files only cost time."""


def on_common_grid(
    path: Path, channels: Sequence[MappedChannel], rate: float | None = None
) -> tuple[float, list[MappedChannel]]:
    """The channels on one uniform grid, and its period [s]; samples that lie on it stay as they are.

    Args:
        path: of the measurement file.
        channels: of one recording.
        rate: wanted samples per second [1/s]; None: the slowest channel's.

    Raises ImportingError for times with gaps, out of order or too slow.
    """
    for channel in channels:
        _check_times(f"{path}, {channel.source.name}", channel)
    channels = [_on_its_grid(channel) for channel in channels]
    sampled = [channel for channel in channels if not _is_logged_on_change(channel)]
    periods = [c.period or 1.0 / max(round(c.rate), LEAST_RATE) for c in sampled]
    period = max(*periods, 1.0 / GREATEST_RATE) if rate is None else 1.0 / rate
    grid = _grid(path, channels, sampled, period)
    return period, [_gridded(path, channel, grid, period) for channel in channels]


def _gridded(path: Path, channel: MappedChannel, grid: NDArray, period: float) -> MappedChannel:
    """The channel at the times of a grid, (samples,) [s]."""
    first = _first_sample(channel, grid, period)
    if first is not None:
        part = slice(first, first + len(grid))
        lines = None if channel.lines is None else channel.lines[part]
        return replace(channel, values=channel.values[part], lines=lines)
    if channel.name == "U":
        last = np.searchsorted(channel.time, grid + SAME_TIME * period, side="right") - 1
        return replace(
            channel,
            values=channel.values[last],
            lines=None,
            treated="at other times, held from the entry before",
        )
    place = Place(file=f"{path}, {channel.source.name}", lines=channel.lines)
    readings = channel.values / UNITS[channel.name][1]
    check_clipped(place, channel.name, readings, 1.0 / channel.rate)  # the filter would hide it
    values = resampled(channel.time, channel.values, grid)
    return replace(channel, values=values, lines=None, treated="at other times, low-pass filtered")


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


def _is_logged_on_change(channel: MappedChannel) -> bool:
    """Whether the entries of the voltage are its changes, at most each with the values around it."""
    if channel.name != "U" or channel.rate >= LEAST_RATE:
        return False
    changes = np.abs(np.diff(channel.values))
    dense = (
        not np.any(changes) or float(np.mean(changes > 0.0)) >= 1.0 / 3.0
    )  # a sampled one mostly stays
    return dense and bool(np.all((changes == 0.0) | (changes > LEAST_STEP * np.ptp(channel.values))))


def _check_times(place: str, channel: MappedChannel) -> None:
    """Times increase without gaps, fast enough. Raises ImportingError."""
    steps = np.diff(channel.time)
    backward = np.flatnonzero(steps <= 0)
    if backward.size:
        at, falls = channel.time[backward[0]], steps[backward[0]] < 0
        line = "" if channel.lines is None else f" (line {channel.lines[backward[0] + 1]})"
        remedy = "cut the recording there, or sort its samples if they are out of order"
        remedy = remedy if falls else "print it with more digits"
        raise ImportingError(f"{place}: time does not increase after {at:.6g} s{line}: {remedy}")
    if _is_logged_on_change(channel):
        return
    usual = float(np.median(steps))
    gap = np.flatnonzero(steps > MOST_STEP * usual)
    if gap.size:
        first, last = channel.time[gap[0]], channel.time[gap[0] + 1]
        raise ImportingError(
            f"{place}: no samples from {first:.6g} to {last:.6g} s, where the usual step is {usual:.3g} "
            f"s{_absent(channel)}"
        )
    if usual * LEAST_RATE > 1.0 + 1e-3:
        raise ImportingError(
            f"{place}: sampled at {1 / usual:.4g} Hz: record at {LEAST_RATE:g} Hz or faster, or "
            "give the right unit of time in a mapping file"
        )


def _absent(channel: MappedChannel) -> str:
    """The longest stretch of missing readings, what the file says of it, and the remedy."""
    values, lines = channel.source.values, channel.source.lines
    first, count = longest_run(~np.isfinite(values))
    cut = "cut the recording there, since a gap is not filled"
    if not count:
        return f": {cut}, or print the time with more digits"
    ends = [first + 1, first + count] if lines is None else [lines[first], lines[first + count - 1]]
    place = f"{'readings' if lines is None else 'lines'} {ends[0]} to {ends[1]}"
    if np.isinf(values[first : first + count]).any():
        return f", and {place} are over-range: record again with a greater range, or {cut}"
    return f", and {place} are empty or marked as missing: {cut}"


def _grid(
    path: Path, channels: Sequence[MappedChannel], sampled: Sequence[MappedChannel], period: float
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
        raise ImportingError(f"{path}: its channels have no time in common: export them together")
    return start + period * np.arange(count)


def _first_sample(channel: MappedChannel, grid: NDArray, period: float) -> int | None:
    """The sample with which the grid begins, if the channel's samples are the grid's; else None."""
    if channel.period is None or abs(channel.period - period) * len(grid) > SAME_TIME * period:
        return None
    first = round((grid[0] - channel.time[0]) / channel.period)
    apart = channel.time[0] + first * channel.period - grid[0]
    fits = first >= 0 and first + len(grid) <= len(channel.time)
    return first if fits and abs(apart) <= SAME_TIME * period else None


def resampled(time: NDArray, values: NDArray, grid: NDArray) -> NDArray:
    """Values on a uniform grid, (grid,), in the unit of `values`.

    Args:
        time: of the samples, increasing, (samples,) [s]; it covers the grid.
        values: (samples,), any unit.
        grid: wanted times, uniform, (grid,) [s].
    """
    period = float(grid[-1] - grid[0]) / (len(grid) - 1)
    own = (len(time) - 1) / float(time[-1] - time[0])
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
