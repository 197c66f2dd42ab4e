"""Parquet, the column files of data pipelines, by pyarrow."""

from pathlib import Path

from numpy.typing import NDArray

from identification.importing.formats.file_format import FileFormat, needed_package
from identification.importing.formats.source_file import SourceChannel
from identification.importing.formats.time_stamps import STAMP, points_in_time, seconds


def read(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric column; its unit is the field's metadata `unit`, if there is one."""
    parquet = needed_package("pyarrow.parquet", "Parquet files")
    table = parquet.read_table(path)
    channels = []
    for field in table.schema:
        values = _numbers_or_times(f"{path}, {field.name}", table.column(field.name).to_numpy())
        if values.dtype.kind in "iufMm":
            unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
            timed = values.dtype.kind in "Mm"
            numbers, begin = seconds(values)
            channels.append(
                SourceChannel(name=field.name, unit="s" if timed else unit, values=numbers, begin=begin)
            )
    return "Parquet", channels


def _numbers_or_times(place: str, values: NDArray) -> NDArray:
    """A column as it is, or as points in time where its texts are some."""
    texts = values.dtype.kind == "O" and len(values) and isinstance(values[0], str)
    return points_in_time(place, values) if texts and STAMP.match(values[0]) else values


PARQUET = FileFormat(name="Parquet", suffixes=(".parquet", ".pq"), read=read)
"""The format, for the registry."""
