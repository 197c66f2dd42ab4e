"""Which channel of a file is which of a recording, its times and its values in SI units."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from identification.importing.mapping_file import (
    QUANTITY,
    ChannelEntry,
    MappingFile,
    mapping_example,
    meaning,
    named_channel,
    proposed,
    split_name,
)
from identification.importing.source_file import ImportingError, SourceChannel, SourceFile
from identification.importing.units import EXAMPLES, PhysicalUnit, needed_unit, parsed_unit
from identification.recordings.recording import CHANNELS

LONGEST_GAP = 5e-3
"""Longest stretch of missing readings that is filled [s]: shorter than any move of valve or pressure."""

SHORTEST_STEP = 1e-6
"""Least step of times whose unit nobody tells [s]: a spreadsheet's days have less."""


def clock_of(
    source: SourceFile, mapping: MappingFile, channel: SourceChannel
) -> tuple[NDArray, np.datetime64 | None]:
    """Times of a channel's samples, (samples,) [s] or NaN, and the point in time of 0 s.

    Those of the channel that the mapping file names for all, or that is called a time, in the nearest
    table. Raises ImportingError if none or several can be meant.
    """
    if channel.time is not None:
        return channel.time, channel.begin
    named = mapping.entry("time").source
    called = [
        other
        for other in source.channels
        if other is not channel
        and other.file == channel.file
        and (_is_called(other, named) if named else holds_times(other))
    ]
    parts = channel.table.split(".")
    for table in (".".join(parts[:depth]) for depth in range(len(parts), -1, -1)):
        clocks = [c for c in called if c.table == table and len(c.values) == len(channel.values)]
        if len(clocks) > 1:
            names = " or ".join(repr(source.label(clock)) for clock in clocks[:4])
            raise ImportingError(
                f"{source.path}: {names} may hold the times of {channel.name}: name one in a mapping "
                'file, as "time" or in the field "time" of the channel'
            )
        if clocks:
            return read_times(source, mapping, clocks[0])
    for clock in called:
        source.check(clock)
    raise ImportingError(
        f"{source.path}: no channel holds the times of {channel.name}: name one, with its unit, as "
        '"time" in a mapping file'
    )


def _is_called(channel: SourceChannel, name: str) -> bool:
    """Whether a mapping file's name means a channel; a field's name means it in every struct."""
    own = channel.name
    return name in (own, channel.full_name, own.rpartition(".")[2], split_name(own)[0])


def holds_times(channel: SourceChannel) -> bool:
    """Whether a channel is called a time, or has a unit of time and increases throughout."""
    if meaning(channel.name, channel.unit) == "time":
        return bool(channel.known.size or channel.fault)
    unit = parsed_unit(channel.unit or split_name(channel.name)[1])
    timed = unit is not None and unit.quantity == "time" and channel.known.size
    return bool(timed and np.all(np.diff(channel.known) > 0))


def read_times(
    source: SourceFile, mapping: MappingFile, times: SourceChannel
) -> tuple[NDArray, np.datetime64 | None]:
    """The mapping file's unit and factor come before the file's own."""
    source.check(times)
    entry = mapping.entry("time")
    text = entry.unit or times.unit or split_name(times.name)[1]
    if not text and 0.0 < np.median(np.abs(np.diff(times.known))) < SHORTEST_STEP:
        raise ImportingError(
            f"{source.path}, {times.name} has no unit, and steps too short for seconds: give its unit "
            f"in a mapping file, for days {mapping_example({'time': times.name}, {'time': 'd'})}"
        )
    unit = needed_unit(text or "s", "time", f"{source.path}, {times.name}")
    return times.values * unit.size * entry.factor, times.begin


@dataclass(frozen=True, kw_only=True)
class MappedChannel:
    """A channel of a file whose meaning, unit and times are known."""

    name: str
    """Of the recording's channel: one of CHANNELS."""
    source: SourceChannel
    unit: PhysicalUnit
    reference: str
    """Of a pressure: gauge, absolute, or absolute, assumed. Empty for others."""
    factor: float
    """Of the mapping file."""
    time: NDArray
    """(samples,) [s], from one begin for all channels of a file."""
    begin: np.datetime64 | None
    """The point in time at which its file's clock is 0; None: not told."""
    values: NDArray
    """(samples,) [SI; pressures absolute]."""
    lines: NDArray | None
    """Line of each sample in a text file, (samples,)."""
    filled: int
    """Missing readings that were filled from their neighbours."""
    left: int
    """Missing readings at the begin and the end, which were left out."""
    period: float | None = None
    """Between samples [s], once they lie on a uniform grid; None: not known, or they jitter."""
    treated: str = "as recorded"
    """How the common grid has its values, in words."""

    @property
    def rate(self) -> float:
        """Samples per second of the file, whose times may jitter [1/s]."""
        return (len(self.time) - 1) / float(self.time[-1] - self.time[0])

    @property
    def conversion(self) -> str:
        """What was done to the readings, in words."""
        ambient = " + ambient pressure" if self.reference == "gauge" else ""
        return f"× {self.unit.size * self.factor:g}{ambient}"


def chosen_channels(source: SourceFile, mapping: MappingFile) -> dict[str, SourceChannel]:
    """The channel of the file for each of a recording. Raises ImportingError."""
    named = {
        name: [named_channel(source, entry.source)]
        for name, entry in mapping.channels.items()
        if entry.source and name != "time"
    }
    taken = {id(channel) for (channel,) in named.values()}
    free = [channel for channel in source.channels if id(channel) not in taken]
    found = {**proposed(free), **named}
    timed = "time" in mapping.channels or any(c.time is not None or holds_times(c) for c in free)
    found.pop("time", None)
    missing = [name for name in CHANNELS if name not in found]
    missing = missing if timed or not missing else ["time", *missing]
    chosen = {name: channels[0] for name, channels in found.items()}
    for channel in chosen.values():
        source.check(channel)
    silent = [name for name, c in chosen.items() if not _unit_text(mapping.entry(name), c)]
    several = {name: channels for name, channels in found.items() if len(channels) > 1}
    if several or silent or missing:
        raise _unclear(source, chosen, several, silent, missing)
    return chosen


def _unclear(
    source: SourceFile,
    chosen: Mapping[str, SourceChannel],
    several: Mapping[str, Sequence[SourceChannel]],
    silent: Sequence[str],
    missing: Sequence[str],
) -> ImportingError:
    """All that a file leaves unclear, with a mapping file that says it.

    several, silent: channels that several of the file may be, or that have no unit.
    """
    said = [
        f"{name} may be {' or '.join(repr(source.label(channel)) for channel in channels[:4])}"
        for name, channels in several.items()
    ]
    if silent:
        said.append(f"there is no unit of {', '.join(silent)}")
    if missing:
        used = {id(channel) for channel in chosen.values()}
        free = [c for c in source.channels if id(c) not in used and meaning(c.name, c.unit) != "time"]
        labels = ", ".join(source.label(channel) for channel in free[:20])
        said.append(f"no channel is known to be {', '.join(missing)}; not used are {labels or 'none'}")
    sources = {n: source.label(c) for n, c in chosen.items() if n in (*several, *silent)}
    units = {name: EXAMPLES[QUANTITY[name]] for name in (*silent, *missing)}
    example = mapping_example(sources | dict.fromkeys(missing, "NAME"), units)
    return ImportingError(
        f"{source.path}: {'; '.join(said)}: say it in a mapping file such as {example}"
    )


def mapped_channels(
    source: SourceFile, mapping: MappingFile, ambient: float | None
) -> list[MappedChannel]:
    """The channels of a recording in SI units. Raises ImportingError.

    ambient: p_env [Pa absolute]; None: not known, so that gauge pressures are refused.
    """
    mapped = [
        _mapped(source, mapping, name, channel, ambient)
        for name, channel in chosen_channels(source, mapping).items()
    ]
    begins = [channel.begin for channel in mapped if channel.begin is not None]
    if 0 < len(begins) < len(mapped):
        raise ImportingError(
            f"{source.path}: some channels have points in time and others only times from a start that "
            "the file does not tell: export all with the same kind of time"
        )
    second = np.timedelta64(1, "s")
    offsets = [(begin - min(begins)) / second for begin in begins] or [0.0] * len(mapped)
    return [replace(c, time=c.time + float(offset)) for c, offset in zip(mapped, offsets, strict=True)]


def _mapped(
    source: SourceFile,
    mapping: MappingFile,
    name: str,
    channel: SourceChannel,
    ambient: float | None,
) -> MappedChannel:
    entry = mapping.entry(name)
    place = f"{source.path}, {channel.name}"
    unit = needed_unit(_unit_text(entry, channel), QUANTITY[name], place)
    assumed = "gauge" if mapping.gauge else "absolute, assumed"
    reference = (unit.reference or assumed) if unit.quantity == "pressure" else ""
    if reference == "gauge" and ambient is None:
        raise ImportingError(
            f"{place} is gauge pressure: give the environment's pressure with --ambient-bar or in the "
            "mapping file"
        )
    offset = ambient if reference == "gauge" and ambient is not None else 0.0
    own = None if entry.time is None else named_channel(source, entry.time)
    times, begin = read_times(source, mapping, own) if own else clock_of(source, mapping, channel)
    if len(times) != len(channel.values):
        raise ImportingError(
            f"{place} has {len(channel.values)} samples and {len(times)} times: export it with one time "
            "for each"
        )
    steps = np.diff(times[np.isfinite(times)])
    steps = steps[steps > 1e-9]  # no converter is faster; stamps of few digits repeat
    longest = max(1, int(LONGEST_GAP / np.median(steps) + 1e-6)) if steps.size else 0
    times = _bridged(times, longest)
    readings = _bridged(channel.values, longest, holds=name == "U")
    good = np.isfinite(times) & np.isfinite(readings)
    if np.count_nonzero(good) < 2:
        raise ImportingError(f"{place} has fewer than two samples: leave the file out")
    return MappedChannel(
        name=name,
        source=channel,
        unit=unit,
        reference=reference,
        factor=entry.factor,
        time=times[good],
        begin=begin,
        values=entry.factor * unit.size * readings[good] + offset,
        lines=None if channel.lines is None else channel.lines[good],
        filled=int(np.count_nonzero(good & ~np.isfinite(channel.values))),
        left=int(good.argmax() + good[::-1].argmax()),
    )


def _unit_text(entry: ChannelEntry, channel: SourceChannel) -> str:
    """From the mapping file, else from the file's field, else from the channel's name."""
    return entry.unit or channel.unit or split_name(channel.name)[1]


def _bridged(values: NDArray, longest: int, *, holds: bool = False) -> NDArray:
    """Values (samples,) with missing ones between their neighbours, of at most so many in a row.

    Slow channels leave many cells empty: nothing is missing there. holds: the last value stays instead.
    """
    series = pd.Series(np.where(np.isfinite(values), values, np.nan))
    missing = series.isna()
    if missing.mean() > 0.25:
        return series.to_numpy()
    run: Any = missing.groupby((~missing).cumsum()).transform("sum")
    filled = series.ffill() if holds else series.interpolate(limit_area="inside")
    return filled.where(~missing | (run <= longest)).to_numpy()
