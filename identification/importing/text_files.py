"""CSV and other text tables of any dialect: encoding, separator, decimal sign, unit row, comments."""

import codecs
import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

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


def read_text(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every named column of numbers."""
    text, encoding = decoded(str(path), path.read_bytes())
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith(COMMENTS)
    ]
    dialect = found_dialect(str(path), [line for _, line in lines])
    names, units, first = _header(str(path), lines, dialect)
    table: Any = pd.read_csv(
        io.StringIO("\n".join(line for _, line in lines[first:])),
        sep=r"\s+" if dialect.separator == " " else dialect.separator,
        decimal=dialect.decimal,
        names=list(range(len(names))),
        skipinitialspace=True,
    )
    numbers = [number for number, _ in lines[first:]]
    channels = [
        _channel(str(path), numbers, table[column], name, units[column])
        for column, name in enumerate(names)
        if name
    ]
    shown = {"\t": "tab", " ": "blanks"}.get(dialect.separator, f"{dialect.separator!r}")
    return f"text (separator {shown}, decimal {dialect.decimal!r}, {encoding})", channels


def _header(
    file: str, lines: Sequence[tuple[int, str]], dialect: Dialect
) -> tuple[list[str], list[str], int]:
    """Names, units and place of the first line of data; what stands above the names is a preamble."""
    width = len(dialect.cells(lines[-1][1]))
    rows = (dialect.cells(line) for _, line in lines)
    above = list(takewhile(lambda cells: len(cells) != width or not dialect.is_data(cells), rows))
    first = len(above)
    if first == len(lines):
        raise ImportingError(
            f"{file}, line {lines[-1][0]}: the numbers have not the {width} columns of the last line: "
            "cut the text below them"
        )
    above = [cells for cells in above if len(cells) == width]
    if not above:
        raise ImportingError(
            f"{file}, line {lines[first][0]}: no line of {width} names stands above the numbers: "
            "add a header"
        )
    with_units = len(above) > 1 and _are_units(above[-1])
    names = above[-2] if with_units else above[-1]
    for name in names:
        if name and names.count(name) > 1:
            raise ImportingError(f"{file}: column {name!r} stands twice: rename one of them")
    return names, above[-1] if with_units else [""] * width, first


def _are_units(cells: Sequence[str]) -> bool:
    """Whether at least half of the filled cells are units."""
    filled = [cell for cell in cells if cell]
    return bool(filled) and sum(is_unit(cell.strip("[]()")) for cell in filled) * 2 >= len(filled)


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
