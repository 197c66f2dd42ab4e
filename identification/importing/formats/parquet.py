"""Parquet, the column files of data pipelines, by pyarrow."""

from pathlib import Path

from identification.importing.formats.file_format import FileFormat, needed_package
from identification.importing.formats.source_file import SourceChannel
from identification.importing.formats.time_stamps import seconds


def read(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric column; its unit is the field's metadata `unit`, if there is one."""
    parquet = needed_package("pyarrow.parquet", "Parquet files")
    table = parquet.read_table(path)
    channels = []
    for field in table.schema:
        values = table.column(field.name).to_numpy()
        if values.dtype.kind in "iufM":
            unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
            stamps = values.dtype.kind == "M"
            channels.append(
                SourceChannel(name=field.name, unit="s" if stamps else unit, values=seconds(values))
            )
    return "Parquet", channels


PARQUET = FileFormat(name="Parquet", suffixes=(".parquet", ".pq"), read=read)
"""The format, for the registry."""
