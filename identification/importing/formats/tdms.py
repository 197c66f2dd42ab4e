"""TDMS, the files of LabVIEW, by npTDMS."""

from pathlib import Path
from typing import Any

import numpy as np

from identification.importing.formats.file_format import FileFormat, needed_package
from identification.importing.formats.source_file import SourceChannel
from identification.importing.formats.time_stamps import seconds

UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription", "unit", "Unit")
"""Properties in which LabVIEW and its tools keep the unit."""


def read(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric channel; waveforms bring their own times."""
    nptdms = needed_package("nptdms", "TDMS files")
    with nptdms.TdmsFile.open(path) as file:
        channels = [
            _channel(group.name, channel)
            for group in file.groups()
            for channel in group.channels()
            if channel.dtype.kind in "iufM" and len(channel) > 1
        ]
    return "TDMS", channels


def _unit(properties: dict[str, Any]) -> str:
    return next((str(properties[name]) for name in UNIT_PROPERTIES if name in properties), "")


def _channel(group: str, channel: Any) -> SourceChannel:
    """A waveform with its times and their begin, or a channel whose times are another channel."""
    values, begin = seconds(np.asarray(channel[:]))
    waveform = bool(channel.properties.get("wf_increment"))
    return SourceChannel(
        name=channel.name,
        unit=_unit(channel.properties) or ("s" if begin is not None else ""),
        values=values,
        time=channel.time_track() if waveform else None,
        begin=channel.properties.get("wf_start_time") if waveform else begin,
        table=group,
    )


TDMS = FileFormat(name="TDMS", suffixes=(".tdms",), read=read)
"""The format, for the registry."""
