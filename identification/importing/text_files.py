"""CSV and other text tables of any dialect: encoding, separator, decimal sign, unit row, comments."""

import codecs
import csv
import io
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from identification.importing.source_file import (
    MOST_CHANNELS,
    STAMP,
    ImportingError,
    SourceChannel,
    check_number,
    limited,
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

COMMENT_COLUMN, UNIT_LABEL, X_COLUMN = "comment", "Y_Unit_Label", "X_Value"
"""Of LabVIEW: a name beside those of the numbers, the title of a row of units, and the name of times."""

TIME_OF_DAY = re.compile(r"(?<![\dT ])\d\d?:\d\d:\d\d")
"""A time of day that begins a cell."""

TYPES = re.compile(r"(float|double|real|single|long|word|byte|bool|u?int)\d*|[fiu]\d+", re.IGNORECASE)
"""Types of numbers, of which some tools print a row."""

LONGEST_LINE = 50 * MOST_CHANNELS
"""Most characters of a line."""

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

    def is_row(self, cells: Sequence[str], width: int) -> bool:
        """Whether a line is data of this many columns; a comment or a last separator may follow."""
        return width <= len(cells) <= width + 1 and self.is_data(cells[:width])


DIALECTS = tuple(
    Dialect(separator=separator, decimal=decimal)
    for separator in (";", "\t", ",", "|", " ")
    for decimal in (".", ",")
)
"""Dialects in the order in which they are preferred where several fit."""


def decoded(file: str, content: bytes) -> tuple[str, str]:
    """Text of a file and its encoding: by byte order mark, else UTF-8, else Windows-1252."""
    encodings = [encoding for mark, encoding in MARKS if content.startswith(mark)]
    zeros = (content[1:2000:2].count(0), content[0:2000:2].count(0))
    if max(zeros) > min(len(content), 2000) // 4:
        encodings += ["utf-16-le" if zeros[0] > zeros[1] else "utf-16-be"]
    for encoding in (*encodings, "utf-8", "cp1252"):
        try:
            return content.decode(encoding), encoding
        except UnicodeDecodeError:
            continue
    raise ImportingError(f"{file} is no text in UTF-8, UTF-16 or Windows-1252: save it as CSV in UTF-8")


def found_dialect(file: str, lines: Sequence[str]) -> Dialect:
    """The dialect in which most cells of the sampled lines are numbers. Raises ImportingError."""
    sample = _sample(lines)
    if max(map(len, sample), default=0) > LONGEST_LINE:
        raise ImportingError(
            f"{file} has lines of more than {LONGEST_LINE:,} characters: export only the bench's "
            "channels"
        )
    best = max(DIALECTS, key=lambda dialect: _fit(dialect, sample))
    if _fit(best, sample) <= 0 and all(map(TIME_OF_DAY.search, sample)):
        raise ImportingError(
            f"{file}: times of day stand in a column of their own: put date and time into one column as "
            "ISO 8601 (2026-03-01T10:00:00.0005), or give times in seconds"
        )
    if _fit(best, sample) <= 0:
        raise ImportingError(
            f"{file}: no separator and decimal sign make columns of numbers of its lines: export it as "
            "CSV, one line per sample, with times in seconds or as ISO 8601 (2026-03-01T10:00:00.0005)"
        )
    return best


def _sample(lines: Sequence[Any]) -> list[Any]:
    middle = len(lines) // 2
    return [*lines[middle : middle + SAMPLE], *lines[-SAMPLE:]]


def _fit(dialect: Dialect, sample: Sequence[str]) -> int:
    """Cells that hold numbers; 0 unless nearly all lines are data of two columns or more."""
    try:
        rows = [dialect.cells(line) for line in sample]
    except csv.Error:
        return 0
    data = [row for row in rows if len(row) > 1 and dialect.is_data(row)]
    return sum(bool(cell) for row in data for cell in row) if len(data) > 0.8 * len(rows) else 0


def read_text(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every named column of numbers."""
    text, encoding = decoded(str(path), path.read_bytes())
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith(COMMENTS)
    ]
    dialect = found_dialect(str(path), [line for _, line in lines])
    names, units, first = _header(path, lines, dialect)
    cut = lines[-1][0] if _ends_cut(text, [line for _, line in lines[first:]], dialect) else None
    lines = lines[:-1] if cut else lines
    table: Any = pd.read_csv(
        io.StringIO("\n".join(line for _, line in lines[first:])),
        sep=r"\s+" if dialect.separator == " " else dialect.separator,
        decimal=dialect.decimal,
        names=list(range(len(names) + 1)),
        index_col=False,
        skipinitialspace=True,
    )
    numbers = [number for number, _ in lines[first:]]
    beyond: Any = pd.to_numeric(table[len(names)], errors="coerce")
    if beyond.notna().any():
        line = numbers[int(beyond.notna().argmax())]
        raise ImportingError(
            f"{path}, line {line} has more than the {len(names)} numbers of the others: mend it, or cut "
            "the file there"
        )
    channels = (
        _channel(str(path), numbers, table[column], name, units[column])
        for column, name in enumerate(names)
        if name
    )
    shown = {"\t": "tab", " ": "blanks"}.get(dialect.separator, f"{dialect.separator!r}")
    told = f"; line {cut} is cut off in its last cell and left out" if cut else ""
    version = f"text (separator {shown}, decimal {dialect.decimal!r}, {encoding}{told})"
    return version, limited(path, channels)


def _ends_cut(text: str, data: Sequence[str], dialect: Dialect) -> bool:
    """Whether a file ends within a cell: without an end of line, in one shorter than all above it."""
    if not text.endswith(data[-1]):
        return False
    *above, last = (len(line.rstrip().rpartition(dialect.separator)[2]) for line in data)
    return last < min(above, default=0)


def _header(
    path: Path, lines: Sequence[tuple[int, str]], dialect: Dialect
) -> tuple[list[str], list[str], int]:
    """Names, units and place of the first line of data; what stands above the names is a preamble."""
    sample = [dialect.cells(line) for _, line in _sample(lines)]
    data = [cells for cells in sample if dialect.is_data(cells)]
    width = Counter(map(len, data)).most_common(1)[0][0]
    check_number(path, width)
    if not dialect.is_row(sample[-1], width):
        raise ImportingError(
            f"{path}, line {lines[-1][0]} has not the {width} numbers of the lines above: delete it if "
            "it is text or was cut off"
        )
    rows = (dialect.cells(line) for _, line in lines)
    higher = list(takewhile(lambda cells: not dialect.is_row(cells, width), rows))
    first, ends_empty = len(higher), not any(cells[-1] for cells in data)
    above = [row for cells in higher for row in _as_wide(cells, width, ends_empty)]
    if not above:
        raise ImportingError(
            f"{path}, line {lines[first][0]}: no line of {width} names stands above the numbers: "
            "add a header"
        )
    names, units = _names_and_units(above)
    for name, count in Counter(names).items():
        if name and count > 1:
            remedy = "rename one of them"
            if name == X_COLUMN:
                remedy = "write it with one column of times (LabVIEW's X_Columns One), or as TDMS"
            raise ImportingError(f"{path}: column {name!r} stands {count} times: {remedy}")
    return names, units, first


def _as_wide(cells: Sequence[str], width: int, ends_empty: bool) -> list[list[str]]:
    """A line above the data as a row of their width; none if it has other columns.

    Lines may end with a separator only above or only in the data, whose last column is then empty.
    """
    filled = list(cells[:width])
    rest = [cell for cell in cells[width:] if cell and cell.lower() != COMMENT_COLUMN]
    missing = width - len(filled)
    return [filled + [""] * missing] if not rest and missing <= ends_empty else []


def _names_and_units(above: Sequence[list[str]]) -> tuple[list[str], list[str]]:
    """Of the lines above the data: the last of units, and the last that is neither units nor types."""
    units = [""] * len(above[0])
    if len(above) > 1:
        units = next((row for row in reversed(above) if _are_units(row)), units)
    rest = [
        row for row in above if row is not units and not all(map(TYPES.fullmatch, filter(None, row)))
    ]
    names = next((row for row in reversed(rest) if not _are_units(row)), rest[-1])
    return names, ["" if cell == UNIT_LABEL else cell for cell in units]


def _are_units(cells: Sequence[str]) -> bool:
    """Whether at least half of the filled cells are units."""
    filled = [cell for cell in cells if cell]
    return bool(filled) and sum(is_unit(cell) for cell in filled) * 2 >= len(filled)


def _channel(file: str, lines: Sequence[int], column: Any, name: str, unit: str) -> SourceChannel:
    """A column of numbers, NaN for an empty cell, or of points in time, as seconds."""
    texts = column.dropna()
    if len(texts) and STAMP.match(str(texts.iloc[0])):
        cells = column.astype(object).where(column.notna(), None)
        values, begin = seconds(points_in_time(f"{file}, {name}", cells))
        return SourceChannel(name=name, unit="s", values=values, begin=begin)
    numbers: Any = pd.to_numeric(column, errors="coerce")
    wrong = np.flatnonzero(numbers.isna() & column.notna())
    if wrong.size:
        raise ImportingError(
            f"{file}, line {lines[wrong[0]]}: {name} is {str(column.iloc[wrong[0]])[:40]!r}, not a "
            "number with the file's decimal sign: mend the cell, or cut the file there"
        )
    return SourceChannel(name=name, unit=unit, values=numbers.to_numpy(dtype=float))
