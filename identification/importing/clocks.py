"""The times of a channel's samples: its own, those of its table, or as the mapping file says."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.importing.channel_names import meaning, named_channel, split_name
from identification.importing.formats.physical_units import needed_unit, parsed_unit
from identification.importing.formats.source_file import ImportingError, SourceChannel, SourceFile
from identification.importing.mapping_file import MappingFile


@dataclass(frozen=True, kw_only=True)
class Clock:
    """When the samples of a channel were taken."""

    times: NDArray
    """(samples,) [s]; NaN where a row has no time."""
    begin: np.datetime64 | None
    """The point in time of 0 s; None: not told."""


def clock_of(
    source: SourceFile, mapping: MappingFile, channel: SourceChannel, named: str | None
) -> Clock:
    """The clock of a channel. Raises ImportingError if none or several can be meant.

    named: the channel of times that the mapping file gives for this one; None: it gives none.
    """
    if named is not None:
        return _read(source, mapping, named_channel(source, named))
    if channel.time is not None:
        return Clock(times=channel.time, begin=channel.begin)
    wanted = mapping.channels.get("time")
    table: str | None = channel.table
    while table is not None:
        found = [
            other
            for other in source.channels
            if other.table == table
            and other is not channel
            and len(other.values) == len(channel.values)
            and (_is_called(other, wanted.source) if wanted else _holds_times(other))
        ]
        if found:
            return _read(source, mapping, _only(source, channel, found))
        table = table.rpartition(".")[0] if table else None
    raise ImportingError(
        f"{source.path}: no channel holds the times of {channel.name}: name one, with its unit, as "
        '"time" in a mapping file'
    )


def _is_called(channel: SourceChannel, name: str) -> bool:
    """Whether a mapping file's name means a channel; a field's name means it in every struct."""
    return name in (channel.name, channel.name.rpartition(".")[2], split_name(channel.name)[0])


def _holds_times(channel: SourceChannel) -> bool:
    """Whether a channel increases throughout and is called a time, or has a unit of time."""
    unit = parsed_unit(channel.unit or split_name(channel.name)[1])
    called = meaning(channel) == "time" or (unit is not None and unit.quantity == "time")
    values = channel.values[np.isfinite(channel.values)]
    return called and (meaning(channel) == "time" or bool(np.all(np.diff(values) > 0)))


def _only(source: SourceFile, channel: SourceChannel, found: list[SourceChannel]) -> SourceChannel:
    if len(found) > 1:
        names = " or ".join(repr(each.name) for each in found[:4])
        raise ImportingError(
            f"{source.path}: {names} may hold the times of {channel.name}: name one in a mapping file, "
            'as "time" or in the field "time" of the channel'
        )
    return found[0]


def _read(source: SourceFile, mapping: MappingFile, times: SourceChannel) -> Clock:
    """A channel of times as a clock; the mapping file's unit and factor come before the file's own."""
    wanted = mapping.channels.get("time")
    text = (wanted.unit if wanted else None) or times.unit or split_name(times.name)[1] or "s"
    unit = needed_unit(text, "time", f"{source.path}, {times.name}")
    factor = wanted.factor if wanted else 1.0
    return Clock(times=times.values * unit.size * factor, begin=times.begin)
