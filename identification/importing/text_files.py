"""CSV and other text tables of any dialect: encoding, separator, decimal sign, unit row, comments."""

import codecs
import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identification.importing.source_file import (
    STAMP,
    ImportingError,
    SourceChannel,
    points_in_time,
    seconds,
)
from identification.importing.units import is_unit

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
"""Byte order marks with their encodings."""

COMMENTS = ("#", "%", "//", "!")
"""Beginnings of lines that hold no data."""

SAMPLE = 40
"""Lines at the middle and at the end of a file from which the dialect is read."""


@dataclass(frozen=True, kw_only=True)
class Dialect:
    """How the cells of a line are told apart, and how they show numbers."""

    separator: str
    decimal: str

    def cells(self, line: str) -> list[str]:
        """The cells of a line, without surrounding blanks."""
        if self.separator == " ":
            return line.split()
        return [cell.strip() for cell in next(csv.reader([line], delimiter=self.separator))]

    def number(self, cell: str) -> float | None:
        """The number in a cell; None if it holds none."""
        if "_" in cell or (self.decimal == "," and "." in cell):
            return None
        try:
            return float(cell.replace(self.decimal, "."))
        except ValueError:
            return None

    def is_data(self, cells: Sequence[str]) -> bool:
        """Whether a line's cells are numbers, points in time or empty, and not all empty."""
        return any(cells) and all(
            not cell or self.number(cell) is not None or STAMP.match(cell) for cell in cells
        )


DIALECTS = tuple(
    Dialect(separator=separator, decimal=decimal)
    for separator in (";", "\t", ",", "|", " ")
    for decimal in (".", ",")
)
"""Dialects in the order in which they are preferred where several fit."""


def decoded(file: str, content: bytes) -> tuple[str, str]:
    """Text of a file and its encoding: by byte order mark, else UTF-8, else Windows-1252."""
    for mark, encoding in MARKS:
        if content.startswith(mark):
            return _decode(file, content, encoding), encoding
    zeros = (content[1:2000:2].count(0), content[0:2000:2].count(0))
    if max(zeros) > min(len(content), 2000) // 4:
        encoding = "utf-16-le" if zeros[0] > zeros[1] else "utf-16-be"
        return _decode(file, content, encoding), encoding
    try:
        return content.decode("utf-8"), "utf-8"
    except UnicodeDecodeError:
        return _decode(file, content, "cp1252"), "cp1252"


def _decode(file: str, content: bytes, encoding: str) -> str:
    try:
        return content.decode(encoding)
    except UnicodeDecodeError:
        raise ImportingError(
            f"{file} is no text in UTF-8, UTF-16 or Windows-1252: save it as CSV in UTF-8"
        ) from None


def found_dialect(file: str, lines: Sequence[str]) -> Dialect:
    """The dialect in which most cells of the sampled lines are numbers. Raises ImportingError."""
    middle = len(lines) // 2
    sample = [*lines[middle : middle + SAMPLE], *lines[-SAMPLE:]]
    best = max(DIALECTS, key=lambda dialect: _fit(dialect, sample))
    if _fit(best, sample) <= 0:
        raise ImportingError(
            f"{file}: no separator and decimal sign make columns of numbers of its lines: export it as "
            "CSV, one line per sample, with times in seconds or as ISO 8601 (2026-03-01T10:00:00.0005)"
        )
    return best


def _fit(dialect: Dialect, sample: Sequence[str]) -> int:
    """Cells that hold numbers; 0 unless nearly all lines are data of two columns or more."""
    try:
        rows = [dialect.cells(line) for line in sample]
    except csv.Error:
        return 0
    data = [row for row in rows if len(row) > 1 and dialect.is_data(row)]
    return sum(bool(cell) for row in data for cell in row) if len(data) > 0.8 * len(rows) else 0


Row = tuple[int, list[str]]
"""Number of a line in its file, and its cells."""


def read_text(path: Path) -> tuple[str, list[SourceChannel]]:
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
