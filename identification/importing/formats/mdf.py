"""MDF 3 and 4, the measurement data format of ASAM (INCA, CANape, vehicle loggers), by asammdf."""

from pathlib import Path

import numpy as np

from identification.importing.formats.file_format import FileFormat, needed_package
from identification.importing.formats.source_file import SourceChannel


def read(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric channel with the times of its master channel."""
    asammdf = needed_package("asammdf", "MDF files")
    with asammdf.MDF(path) as mdf:
        channels = [
            SourceChannel(
                name=signal.name,
                unit=signal.unit or "",
                values=np.asarray(signal.samples, dtype=float),
                time=np.asarray(signal.timestamps, dtype=float),
                table=f"group {signal.group_index}",
            )
            for signal in mdf.iter_channels(skip_master=True)
            if np.ndim(signal.samples) == 1 and np.asarray(signal.samples).dtype.kind in "iufb"
        ]
        return f"MDF {mdf.version}", channels


MDF = FileFormat(name="MDF", suffixes=(".mf4", ".mdf", ".dat"), read=read)
"""The format, for the registry."""
