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
            SourceChannel(
                name=channel.name,
                unit=_unit(channel.properties),
                values=seconds(np.asarray(channel[:])),
                time=_times(channel),
                table=group.name,
            )
            for group in file.groups()
            for channel in group.channels()
            if channel.dtype.kind in "iufM" and len(channel) > 1
        ]
    return "TDMS", channels


def _unit(properties: dict[str, Any]) -> str:
    return next((str(properties[name]) for name in UNIT_PROPERTIES if name in properties), "")


def _times(channel: Any) -> np.ndarray | None:
    """Times of a waveform [s]; None for a channel whose times are another channel."""
    if not channel.properties.get("wf_increment"):
        return None
    return channel.time_track()


TDMS = FileFormat(name="TDMS", suffixes=(".tdms",), read=read)
"""The format, for the registry."""
