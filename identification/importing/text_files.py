"""CSV and other text tables of any dialect: encoding, separator, header rows, and what stands below.

What is no row of samples above or below the numbers is left out, and said; all between has to be read.
"""

import codecs
import csv
import io
import re
from collections import Counter
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from identification.importing.cells import MISSING, OVER_RANGE, SURE_DECIMAL, X_COLUMN, Columns, is_value
from identification.importing.mapping_file import meaning
from identification.importing.source_file import ImportingError, SourceChannel
from identification.importing.times import is_point
from identification.importing.units import is_unit, parsed_unit

COMMENT = re.compile(r"\s*(#(?!NV|N/A|DIV|VAL|WERT)|%|//|!)")
"""Beginning of a line that holds no data."""

COMMENT_COLUMN, UNIT_LABEL = "comment", "Y_Unit_Label"
"""Of LabVIEW: a name beside those of the numbers, and the title of a row of units."""

TYPES = re.compile(
    r"(float|double|l?real|single|long|d?word|byte|bool|u?d?int)\d*|[fiu]\d+", re.IGNORECASE
)
"""Types of numbers, of which some tools print a row."""

SEPARATORS = (";", "\t", ",", "|", " ")
"""Separators in the order in which they are preferred where several fit."""

SAMPLE = 40
"""Lines at the middle and at the end of a file from which the dialect is read."""


def cells_of(line: str, separator: str) -> list[str]:
    """The cells of a line, without surrounding blanks."""
    if separator == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def decoded(file: str, content: bytes) -> tuple[str, str]:
    """Text of a file and its encoding: UTF-16 by its byte order mark, else UTF-8, else Windows-1252."""
    wide = content[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    for encoding in ("utf-16",) if wide else ("utf-8-sig", "cp1252"):
        with suppress(UnicodeDecodeError):
            return content.decode(encoding), encoding
    raise ImportingError(f"{file} is no text in UTF-8, UTF-16 or Windows-1252: save it as CSV in UTF-8")


@dataclass(frozen=True, kw_only=True)
class TextTable:
    """The lines of a text file that may hold data, and how they are read."""

    path: Path
    lines: Sequence[tuple[int, str]]
    """Number and text."""
    missing: Collection[str]
    """Marks of missing readings that the mapping file names."""
    separator: str = ""
    width: int = 0
    """Cells of most lines."""
    measured: tuple[int, ...] = ()
    """Columns that hold numbers, points in time or marks in most of the sampled lines."""

    def cells(self, line: int) -> list[str]:
        """The cells of one of the lines."""
        return cells_of(self.lines[line][1], self.separator)

    def is_known(self, cell: str) -> bool:
        """Whether a cell can be read, also as a reading that is missing or beyond the range."""
        missing = not cell or cell in MISSING or cell in self.missing
        return missing or is_value(cell) or bool(OVER_RANGE.fullmatch(cell))

    def is_sample(self, line: int) -> bool:
        """Whether a line has all cells, perhaps a comment after them, and begins as samples do."""
        cells = self.cells(line)
        whole = self.width <= len(cells) <= self.width + 1
        return whole and is_value(cells[self.measured[0]])

    def sampled(self) -> list[int]:
        """Some lines from the middle and the end, by which the dialect is known."""
        middle, count = len(self.lines) // 2, len(self.lines)
        return [*range(middle, min(middle + SAMPLE, count)), *range(max(count - SAMPLE, 0), count)]


def found_table(path: Path, text: str, missing: Collection[str]) -> TextTable:
    """The lines of a text with the separator that makes most cells readable. Raises ImportingError."""
    numbered = enumerate(text.splitlines(), start=1)
    lines = [(n, line) for n, line in numbered if line.strip() and not COMMENT.match(line)]
    table = TextTable(path=path, lines=lines, missing=missing)
    sampled = table.sampled()
    tried = [_with_separator(replace(table, separator=separator), sampled) for separator in SEPARATORS]
    best, values = max(tried, key=lambda pair: pair[1])
    if not values:
        number, line = lines[sampled[0]] if sampled else (1, "")
        raise ImportingError(
            f"{path}, line {number}: no separator makes columns of numbers of {line[:40]!r}: export the "
            "file as CSV, one line per sample, with times in seconds or as 2026-03-01T10:00:00.0005"
        )
    return best


def _with_separator(table: TextTable, sampled: Sequence[int]) -> tuple[TextTable, int]:
    """The table with width and columns of its separator, and how many cells are values.

    0 unless nearly all lines have two cells or more, half of which can be read.
    """
    try:
        rows = [table.cells(line) for line in sampled]
    except csv.Error:
        return table, 0
    rows = [row for row in rows if len(row) > 1 and 2 * sum(map(table.is_known, row)) >= len(row)]
    if len(rows) <= 0.8 * len(sampled):
        return table, 0
    width = Counter(map(len, rows)).most_common(1)[0][0]
    usual = [row for row in rows if len(row) == width]
    values = np.array([[is_value(cell) for cell in row] for row in usual])
    known = np.array([[table.is_known(cell) for cell in row] for row in usual])
    measured = np.flatnonzero((np.mean(known, axis=0) >= 0.5) & np.any(values, axis=0))
    return replace(table, width=width, measured=tuple(measured.tolist())), int(np.sum(values))


def read_text(path: Path, missing: Collection[str] = ()) -> tuple[str, list[SourceChannel]]:
    """Every named column of numbers or points in time; missing: further marks of missing readings."""
    text, encoding = decoded(str(path), path.read_bytes())
    table = found_table(path, text, missing)
    names, units, first = _header(table)
    stop, told = _end(table, text, first)
    data = [line for _, line in table.lines[first:stop]]
    decimal = _decimal(table)
    frame: Any = pd.read_csv(
        io.StringIO("\n".join(data)),
        sep=r"\s+" if table.separator == " " else table.separator,
        decimal=decimal,
        names=list(range(len(names) + 1)),
        index_col=False,
        skipinitialspace=True,
        low_memory=False,
        na_values=[*MISSING, *missing],
    )
    lines = np.array([number for number, _ in table.lines[first:stop]])
    beyond = np.isfinite(np.asarray(pd.to_numeric(frame[len(names)], errors="coerce"), dtype=float))
    if beyond.any():  # a comment may stand there
        raise ImportingError(
            f"{path}, line {lines[beyond.argmax()]} has more than the {table.width} numbers of the "
            "others: mend it, or cut the file there"
        )
    copies = frame.duplicated()
    if copies.any():
        told.append(f"{copies.sum()} copies of lines left out, such as line {lines[copies.argmax()]}")
    shown = {"\t": "tab", " ": "blanks"}.get(table.separator, f"{table.separator!r}")
    dialect = f"separator {shown}, decimal {decimal!r}, {encoding}"
    columns = Columns(frame=frame[~copies], lines=lines, decimal=decimal, names=names, units=units)
    return f"text ({'; '.join([dialect, *told])})", list(columns.channels())


def _decimal(table: TextTable) -> str:
    """The decimal sign of most of the sampled cells in which a sign cannot mark thousands."""
    cells = [cell for line in table.sampled() for cell in table.cells(line) if not is_point(cell)]
    signs = Counter(found[1] or found[2] for cell in cells if (found := SURE_DECIMAL.fullmatch(cell)))
    return "," if table.separator != "," and signs[","] > signs["."] else "."


def _end(table: TextTable, text: str, first: int) -> tuple[int, list[str]]:
    """Place after the last line of samples, and what is left out below it, in words."""
    stop = count = len(table.lines)
    while stop > first and not table.is_sample(stop - 1):
        stop -= 1
    if stop < count:
        numbers = [str(table.lines[k][0]) for k in range(stop, count)]
        begins = ", ".join(repr(table.cells(k)[0][:20]) for k in range(stop, min(stop + 3, count)))
        ends = " to ".join(dict.fromkeys((numbers[0], numbers[-1])))
        return stop, [f"below the samples, line{'s' * (len(numbers) > 1)} {ends} ({begins}) left out"]
    number, last = table.lines[-1]
    *above, end = (len(line.rstrip().rpartition(table.separator)[2]) for _, line in table.lines[first:])
    if text.endswith(last) and end < max(above, default=0):  # a file that was cut, without end of line
        return stop - 1, [f"line {number} may be cut off in its last cell and is left out"]
    return stop, []


def _header(table: TextTable) -> tuple[list[str], list[str], int]:
    """Names, units and place of the first line of samples; what stands above the names is a preamble."""
    count = len(table.lines)
    top = [table.cells(k) for k in range(min(SAMPLE, count))]
    named = next((k for k, row in enumerate(top) if sum(meaning(c) is not None for c in row) > 1), 0)
    first = next((k for k in range(named, count) if table.is_sample(k)), count)
    higher = [table.cells(k) for k in range(first)]
    ends_empty = table.width - 1 not in table.measured
    above = [row for cells in higher for row in _as_wide(cells, table.width, ends_empty)]
    if not above:
        raise ImportingError(
            f"{table.path}: no line of {table.width} names stands above the numbers: add a header"
        )
    names, units = _names_and_units(above)
    for row in higher if names.count(X_COLUMN) > 1 else ():  # LabVIEW's columns of times have no units
        if row[0] == UNIT_LABEL and len(row) <= len(names) - names.count(X_COLUMN) + 1:
            told = iter(row[1:])
            units = ["" if name == X_COLUMN else next(told, "") for name in names]
        if row[0] == "Time" and len({*filter(None, row[1:])}) > 1:
            raise ImportingError(
                f"{table.path}: its channels begin at different times of day "
                f"({', '.join(row[1:4])}...): export it as TDMS"
            )
    for name, times_named in Counter(names).items():
        if name and times_named > 1 and name != X_COLUMN:
            raise ImportingError(
                f"{table.path}: column {name!r} stands {times_named} times: rename one of them"
            )
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
    """Of the lines above the data: the one of most units, and the one of most known names, or the last.

    Where that has a title instead of a known name, as "Label" above "TIME", another line has the name.
    Neither units nor types of numbers are names.
    """
    units = max(reversed(above), key=lambda row: sum(parsed_unit(cell) is not None for cell in row))
    units = units if len(above) > 1 and _are_units(units) else [""] * len(units)
    typed = [row for row in above if all(map(TYPES.fullmatch, filter(None, row)))]
    rest = [row for row in above if row is not units and row not in typed]
    rest = [row for row in rest if not _are_units(row)] or rest[-1:] or above[-1:]
    best = max(reversed(rest), key=lambda row: sum(meaning(cell) is not None for cell in row))
    names = [
        next((row[k] for row in (best, *rest) if meaning(row[k])), best[k]) for k in range(len(best))
    ]
    return names, [unit if column or is_unit(unit) else "" for column, unit in enumerate(units)]


def _are_units(cells: Sequence[str]) -> bool:
    """Whether at least half of the filled cells are units."""
    filled = [cell for cell in cells if cell]
    return bool(filled) and sum(is_unit(cell) for cell in filled) * 2 >= len(filled)
