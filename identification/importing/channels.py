"""Which channel of a file is which of a recording, its times and its values in SI units."""

from collections.abc import Mapping
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
from identification.importing.times import begin_offsets, in_order
from identification.importing.units import PhysicalUnit, needed_unit, parsed_unit
from identification.recordings.recording import CHANNELS

LONGEST_GAP = 5e-3
"""Longest stretch of missing readings that is filled [s]: shorter than any move of valve or pressure."""

COMMANDS = ("U", "sigma_S")
"""Channels that may be logged on change only, and that hold their value where a reading is missing."""


def clock_of(
    source: SourceFile, mapping: MappingFile, channel: SourceChannel, named: str | None
) -> tuple[NDArray, np.datetime64 | None]:
    """Times of a channel's samples, (samples,) [s] or NaN, and the point in time of 0 s.

    Raises ImportingError if none or several can be meant.
    named: the channel of times that the mapping file gives for this one; None: it gives none.
    """
    if named is not None:
        return _read(source, mapping, named_channel(source, named))
    if channel.time is not None:
        return in_order(channel.time), channel.begin
    named = mapping.channels.get("time", ChannelEntry()).source
    table: str | None = channel.table
    while table is not None:
        clocks = [
            other
            for other in source.channels
            if other.table == table
            and other is not channel
            and len(other.values) == len(channel.values)
            and (_is_called(other, named) if named else _holds_times(other))
        ]
        if len(clocks) > 1:
            names = " or ".join(repr(source.label(clock)) for clock in clocks[:4])
            raise ImportingError(
                f"{source.path}: {names} may hold the times of {channel.name}: name one in a mapping "
                'file, as "time" or in the field "time" of the channel'
            )
        if clocks:
            return _read(source, mapping, clocks[0])
        table = table.rpartition(".")[0] if table else None
    raise ImportingError(
        f"{source.path}: no channel holds the times of {channel.name}: name one, with its unit, as "
        '"time" in a mapping file'
    )


def _is_called(channel: SourceChannel, name: str) -> bool:
    """Whether a mapping file's name means a channel; a field's name means it in every struct."""
    own = channel.name
    return name in (own, channel.full_name, own.rpartition(".")[2], split_name(own)[0])


def _holds_times(channel: SourceChannel) -> bool:
    """Whether a channel is called a time, or has a unit of time and increases throughout."""
    if meaning(channel.name, channel.unit) == "time":
        return bool(channel.known.size)
    unit = parsed_unit(channel.unit or split_name(channel.name)[1])
    timed = unit is not None and unit.quantity == "time" and channel.known.size
    return bool(timed and np.all(np.diff(channel.known) > 0))


def _read(
    source: SourceFile, mapping: MappingFile, times: SourceChannel
) -> tuple[NDArray, np.datetime64 | None]:
    """The mapping file's unit and factor come before the file's own."""
    entry = mapping.channels.get("time", ChannelEntry())
    text = entry.unit or times.unit or split_name(times.name)[1] or "s"
    unit = needed_unit(text, "time", f"{source.path}, {times.name}")
    return in_order(times.values) * unit.size * entry.factor, times.begin


SUPPLY_PAIR = ("p1a", "p1b")
REQUIRED = tuple(name for name in CHANNELS if name != "p1")


@dataclass(frozen=True, kw_only=True)
class MappedChannel:
    """A channel of a file whose meaning, unit and times are known."""

    name: str
    """Of the recording's channel: one of channel_names.QUANTITY but time."""
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
    filled: int
    """Missing readings that were filled from their neighbours."""
    period: float | None = None
    """Between samples [s], once they lie on a uniform grid; None: not known, or they jitter."""

    @property
    def conversion(self) -> str:
        """What was done to the readings, in words."""
        steps = [f"× {self.unit.size * self.factor:g}"]
        steps += ["+ ambient pressure"] if self.reference == "gauge" else []
        return " ".join(steps)


def chosen_channels(source: SourceFile, mapping: MappingFile) -> dict[str, SourceChannel]:
    """The channel of the file for each of a recording. Raises ImportingError for what is unclear."""
    chosen = {
        name: named_channel(source, entry.source)
        for name, entry in mapping.channels.items()
        if name != "time" and entry.source
    }
    taken = {id(channel) for channel in chosen.values()}
    free = [channel for channel in source.channels if id(channel) not in taken]
    candidates = {n: cs for n, cs in proposed(free).items() if n != "time" and n not in chosen}
    several = {n: [source.label(c) for c in cs[:4]] for n, cs in candidates.items() if len(cs) > 1}
    if several:
        listed = ", ".join(f"{n} may be {' or '.join(map(repr, names))}" for n, names in several.items())
        first = {name: labels[0] for name, labels in several.items()}
        raise ImportingError(
            f"{source.path}: {listed}: choose in a mapping file such as "
            f"{mapping_example(first, units=False)}"
        )
    chosen |= {name: channels[0] for name, channels in candidates.items()}
    if "p1" in chosen:
        chosen = {name: channel for name, channel in chosen.items() if name not in SUPPLY_PAIR}
    _check_complete(source, mapping, chosen)
    silent = {
        name: source.label(channel)
        for name, channel in chosen.items()
        if not _unit_text(mapping.channels.get(name, ChannelEntry()), channel)
    }
    if silent:
        raise ImportingError(
            f"{source.path}: there is no unit of {', '.join(silent)}: give the right ones in a mapping "
            f"file such as {mapping_example(silent)}"
        )
    return chosen


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
    offsets = begin_offsets(str(source.path), [channel.begin for channel in mapped])
    return [
        replace(channel, time=channel.time + offset)
        for channel, offset in zip(mapped, offsets, strict=True)
    ]


def _check_complete(
    source: SourceFile, mapping: MappingFile, chosen: Mapping[str, SourceChannel]
) -> None:
    supply = () if "p1" in chosen or all(name in chosen for name in SUPPLY_PAIR) else ("p1",)
    missing = [name for name in (*supply, *REQUIRED) if name not in chosen]
    if missing:
        used = {id(channel) for channel in chosen.values()}
        clocks = {id(c) for c in source.channels if meaning(c.name, c.unit) == "time"}
        timed = clocks or any(channel.time is not None for channel in source.channels)
        missing = missing if timed or "time" in mapping.channels else ["time", *missing]
        free = [source.label(channel) for channel in source.channels if id(channel) not in used | clocks]
        raise ImportingError(
            f"{source.path}: no channel is known to be {', '.join(missing)}; not used are "
            f"{', '.join(free[:20]) or 'none'}: name it in a mapping file such as "
            f"{mapping_example(dict.fromkeys(missing, 'NAME'))}"
        )


def _mapped(
    source: SourceFile,
    mapping: MappingFile,
    name: str,
    channel: SourceChannel,
    ambient: float | None,
) -> MappedChannel:
    entry = mapping.channels.get(name, ChannelEntry())
    place = f"{source.path}, {channel.name}"
    unit = _unit(place, name, channel, entry)
    assumed = "gauge" if mapping.gauge else "absolute, assumed"
    reference = (unit.reference or assumed) if unit.quantity == "pressure" else ""
    offset = 0.0
    if reference == "gauge":
        if ambient is None:
            raise ImportingError(
                f"{place} is gauge pressure: give the environment's pressure with --ambient-bar or in "
                "the mapping file"
            )
        offset = ambient
    times, begin = clock_of(source, mapping, channel, entry.time)
    if len(times) != len(channel.values):
        raise ImportingError(
            f"{place} has {len(channel.values)} samples and {len(times)} times: export it with one time "
            "for each"
        )
    steps = np.diff(times[np.isfinite(times)])
    steps = steps[steps > 1e-9]  # no converter is faster; stamps of few digits repeat
    longest = max(1, int(LONGEST_GAP / np.median(steps))) if steps.size else 0
    times = _bridged(times, longest)
    readings = _bridged(channel.values, longest, holds=name in COMMANDS)
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
        filled=int(np.count_nonzero(good & ~np.isfinite(channel.values))),
    )


def _unit(place: str, name: str, channel: SourceChannel, entry: ChannelEntry) -> PhysicalUnit:
    inside = split_name(channel.name)[1]
    text = _unit_text(entry, channel)
    unit = needed_unit(text, QUANTITY[name], place)
    if not entry.unit and channel.unit and inside:
        other = needed_unit(inside, QUANTITY[name], place)
        if not np.isclose(other.size, unit.size, rtol=1e-6):
            raise ImportingError(
                f"{place} has {inside!r} in its name and {text!r} as its unit: give the right unit in a "
                "mapping file"
            )
    return unit


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


def supply_pair_mean(signals: Mapping[str, NDArray]) -> dict[str, NDArray]:
    """Signals, each (samples,), in which p1 stands for the mean of p1a and p1b."""
    if not all(name in signals for name in SUPPLY_PAIR):
        return dict(signals)
    rest = {name: values for name, values in signals.items() if name not in SUPPLY_PAIR}
    return {**rest, "p1": np.mean([signals[name] for name in SUPPLY_PAIR], axis=0)}
