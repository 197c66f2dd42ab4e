"""One uniform grid of times for the channels of a recording."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.importing.formats.source_file import ImportingError
from identification.importing.mapping import MappedChannel
from identification.importing.resampling import resampled, usual_rate
from identification.importing.settings import IMPORT, ImportSettings
from identification.recordings.recording import CampaignError
from identification.recordings.rules import RULES
from identification.recordings.sampling_times import sampling_period


@dataclass(frozen=True, kw_only=True)
class GriddedSignals:
    """The channels of a recording on common times."""

    period: float
    """Between samples [s]."""
    signals: Mapping[str, NDArray]
    """By channel, each (samples,) [SI]."""
    resampled: tuple[str, ...]
    """Channels whose samples are not the file's own."""


def on_common_grid(
    place: str,
    channels: Sequence[MappedChannel],
    rate: float | None = None,
    settings: ImportSettings = IMPORT,
) -> GriddedSignals:
    """The channels on one uniform grid; samples that lie on it already are left as they are.

    Args:
        place: begins the messages.
        channels: of one recording.
        rate: wanted samples per second [1/s]; None: the slowest channel's.
        settings: what a gap is, and how channels are resampled.

    Raises ImportingError for times with gaps, out of order or too slow.
    """
    for channel in channels:
        _check_times(f"{place}, {channel.source.name}", channel, settings)
    own = {channel.name: _own_period(channel) for channel in channels}
    period = _period(channels, own, rate, settings)
    grid = _grid(place, channels, own, period)
    signals, changed = {}, []
    for channel in channels:
        first = _first_sample(channel, own[channel.name], grid, period, settings)
        if first is None:
            signals[channel.name] = resampled(channel.time, channel.values, grid, settings)
            changed.append(channel.name)
        else:
            signals[channel.name] = channel.values[first : first + len(grid)]
    return GriddedSignals(period=period, signals=signals, resampled=tuple(changed))


def _check_times(place: str, channel: MappedChannel, settings: ImportSettings) -> None:
    steps = np.diff(channel.time)
    backward = np.flatnonzero(steps <= 0)
    if backward.size:
        at = channel.time[backward[0]]
        raise ImportingError(f"{place}: time does not increase after {at:.6g} s: sort the samples")
    usual = float(np.median(steps))
    gap = np.flatnonzero(steps > settings.most_step * usual)
    if gap.size:
        first, last = channel.time[gap[0]], channel.time[gap[0] + 1]
        raise ImportingError(
            f"{place}: no samples from {first:.6g} to {last:.6g} s, where the usual step is {usual:.3g} "
            "s: cut the recording there, since a gap is not filled"
        )
    if channel.name != "sigma_S" and usual * RULES.least_rate > 1.0 + 1e-3:
        raise ImportingError(
            f"{place}: sampled at {1 / usual:.4g} Hz: record at {RULES.least_rate:g} Hz or faster, or "
            "give the right unit of time in a mapping file"
        )


def _own_period(channel: MappedChannel) -> float | None:
    """Period of a channel's samples [s]; None if they jitter."""
    try:
        return sampling_period("", channel.time - channel.time[0])
    except CampaignError:
        return None


def _period(
    channels: Sequence[MappedChannel],
    own: Mapping[str, float | None],
    rate: float | None,
    settings: ImportSettings,
) -> float:
    if rate is not None:
        return 1.0 / rate
    periods = [
        own[channel.name] or 1.0 / max(round(usual_rate(channel.time)), RULES.least_rate)
        for channel in channels
        if channel.name != "sigma_S"
    ]
    return max(max(periods), 1.0 / settings.greatest_rate)


def _grid(
    place: str, channels: Sequence[MappedChannel], own: Mapping[str, float | None], period: float
) -> NDArray:
    """Times within all channels, (samples,) [s], on the samples of a uniform channel if there is one."""
    start = max(float(channel.time[0]) for channel in channels)
    end = min(float(channel.time[-1]) for channel in channels)
    for channel in channels:
        step = own[channel.name]
        if step is not None and abs(step / period - 1.0) < 1e-6:
            later = channel.time[channel.time >= start - 1e-3 * period]
            start = float(later[0]) if later.size else start
            break
    count = int(np.floor((end - start) / period + 1e-2)) + 1
    if count < 2:
        raise ImportingError(f"{place}: its channels have no time in common: export them together")
    return start + period * np.arange(count)


def _first_sample(
    channel: MappedChannel,
    own: float | None,
    grid: NDArray,
    period: float,
    settings: ImportSettings,
) -> int | None:
    """The sample with which the grid begins, if the channel's samples are the grid's; else None."""
    if own is None or abs(own - period) * len(grid) > settings.same_time * period:
        return None
    first = round((grid[0] - channel.time[0]) / own)
    apart = channel.time[0] + first * own - grid[0]
    fits = first >= 0 and first + len(grid) <= len(channel.time)
    return first if fits and abs(apart) <= settings.same_time * period else None
