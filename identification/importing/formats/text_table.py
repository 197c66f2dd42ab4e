"""CSV and other text tables of any dialect: separator, decimal sign, unit row, comments, encoding."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identification.importing.formats.file_format import FileFormat
from identification.importing.formats.physical_units import is_unit
from identification.importing.formats.source_file import ImportingError, SourceChannel
from identification.importing.formats.text_dialect import COMMENTS, Dialect, decoded, found_dialect
from identification.importing.formats.time_stamps import STAMP, points_in_time, seconds

Row = tuple[int, list[str]]
"""Number of a line in its file, and its cells."""


def read(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every named column of numbers."""
    text, encoding = decoded(str(path), path.read_bytes())
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith(COMMENTS)
    ]
    dialect = found_dialect(str(path), [line for _, line in lines])
    rows = [(number, dialect.cells(line)) for number, line in lines]
    names, units, data = _parts(str(path), rows, dialect)
    channels = [
        _times(str(path), data, column, name)
        if _stamped(data, column)
        else SourceChannel(
            name=name, unit=units[column], values=_column(str(path), data, column, name, dialect)
        )
        for column, name in enumerate(names)
        if name
    ]
    shown = {"\t": "tab", " ": "blanks"}.get(dialect.separator, f"{dialect.separator!r}")
    return f"text (separator {shown}, decimal {dialect.decimal!r}, {encoding})", channels


def _parts(
    file: str, rows: Sequence[Row], dialect: Dialect
) -> tuple[list[str], list[str], Sequence[Row]]:
    """Names, units and lines of data; what stands above the names is a preamble."""
    width = len(rows[-1][1])
    first = next(
        i for i, (_, cells) in enumerate(rows) if len(cells) == width and dialect.is_data(cells)
    )
    above = [cells for _, cells in rows[:first] if len(cells) == width]
    if not above:
        raise ImportingError(
            f"{file}, line {rows[first][0]}: no line of {width} names stands above the numbers: "
            "add a header"
        )
    with_units = len(above) > 1 and _are_units(above[-1])
    names = above[-2] if with_units else above[-1]
    units = above[-1] if with_units else [""] * width
    _check_names(file, names)
    return names, units, rows[first:]


def _are_units(cells: Sequence[str]) -> bool:
    """Whether at least half of the filled cells are units."""
    filled = [cell for cell in cells if cell]
    return bool(filled) and sum(is_unit(cell.strip("[]()")) for cell in filled) * 2 >= len(filled)


def _check_names(file: str, names: Sequence[str]) -> None:
    for name in names:
        if name and names.count(name) > 1:
            raise ImportingError(f"{file}: column {name!r} stands twice: rename one of them")


def _stamped(data: Sequence[Row], column: int) -> bool:
    cells = data[0][1]
    return column < len(cells) and STAMP.match(cells[column]) is not None


def _times(file: str, data: Sequence[Row], column: int, name: str) -> SourceChannel:
    """A column of points in time, as seconds."""
    texts = (cells[column] if column < len(cells) else "" for _, cells in data)
    values, begin = seconds(points_in_time(f"{file}, {name}", texts))
    return SourceChannel(name=name, unit="s", values=values, begin=begin)


def _column(file: str, data: Sequence[Row], column: int, name: str, dialect: Dialect) -> NDArray:
    """The numbers of a column, (samples,); NaN for an empty cell."""
    values = np.empty(len(data))
    for place, (line, cells) in enumerate(data):
        cell = cells[column] if column < len(cells) else ""
        number = dialect.number(cell) if cell else np.nan
        if number is None:
            raise ImportingError(
                f"{file}, line {line}: {name} is {cell[:40]!r}, not a number with decimal sign "
                f"{dialect.decimal!r}: mend the cell, or cut the file there"
            )
        values[place] = number
    return values


TEXT = FileFormat(name="text", suffixes=(".csv", ".txt", ".tsv", ".asc"), read=read)
"""The format, for the registry."""
