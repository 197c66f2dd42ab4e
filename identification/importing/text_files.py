"""CSV and other text tables of any dialect: encoding, separator, decimal sign, header rows, comments.

Cells hold numbers with a decimal point or comma, points in time, or a word for a missing reading.
"""

import codecs
import csv
import io
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import islice, takewhile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from identification.importing import times
from identification.importing.mapping_file import meaning
from identification.importing.source_file import (
    MOST_CHANNELS,
    ImportingError,
    SourceChannel,
    check_number,
    limited,
)
from identification.importing.units import is_unit

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
"""Byte order marks with their encodings."""

COMMENT = re.compile(r"\s*(#(?!NV|N/A|DIV|VAL|WERT)|%|//|!)")
"""Beginning of a line that holds no data."""

MISSING = (
    "NULL", "null", "None", "#NV", "#N/A", "N/A", "n/a", "n.a.", "NA", "NAN", "-", "--", "---", "***",
    "1.#QNAN", "-1.#IND", "1.#INF", "-1.#INF", "#DIV/0!", "#VALUE!", "#WERT!",
)  # fmt: skip
"""Cells that hold no reading, beside empty ones, NaN and Inf."""

COMMENT_COLUMN, UNIT_LABEL, X_COLUMN = "comment", "Y_Unit_Label", "X_Value"
"""Of LabVIEW: a name beside those of the numbers, the title of a row of units, and the name of times."""

TYPES = re.compile(
    r"(float|double|l?real|single|long|d?word|byte|bool|u?d?int)\d*|[fiu]\d+", re.IGNORECASE
)
"""Types of numbers, of which some tools print a row."""

SEPARATORS = (";", "\t", ",", "|", " ")
"""Separators in the order in which they are preferred where several fit."""

LONGEST_LINE = 50 * MOST_CHANNELS
"""Most characters of a line."""

SAMPLE = 40
"""Lines at the middle and at the end of a file from which the dialect is read."""


def cells_of(line: str, separator: str) -> list[str]:
    """The cells of a line, without surrounding blanks."""
    if separator == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def is_data(cells: Sequence[str]) -> bool:
    """Whether a line's cells are numbers, points in time or missing, and not all of them missing."""
    return any(map(_is_value, cells)) and all(
        not cell or cell in MISSING or _is_value(cell) for cell in cells
    )


def _is_value(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return times.is_point(cell)
    return "_" not in cell  # Python's own 1_000


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


def found_separator(file: str, lines: Sequence[str]) -> str:
    """The separator that makes most cells of the sampled lines data. Raises ImportingError."""
    sample = _sample(lines)
    if max(map(len, sample), default=0) > LONGEST_LINE:
        raise ImportingError(
            f"{file} has lines of more than {LONGEST_LINE:,} characters: export only the bench's "
            "channels"
        )
    best = max(SEPARATORS, key=lambda separator: _fit(separator, sample))
    if _fit(best, sample) <= 0:
        raise ImportingError(
            f"{file}: no separator and decimal sign make columns of numbers of its lines: export it as "
            "CSV, one line per sample, with times in seconds or as ISO 8601 (2026-03-01T10:00:00.0005)"
        )
    return best


def _sample(lines: Sequence[Any]) -> list[Any]:
    middle = len(lines) // 2
    return [*lines[middle : middle + SAMPLE], *lines[-SAMPLE:]]


def _fit(separator: str, sample: Sequence[str]) -> int:
    """Cells that hold data; 0 unless nearly all lines are data of two columns or more."""
    try:
        rows = [cells_of(line, separator) for line in sample]
    except csv.Error:
        return 0
    data = [row for row in rows if len(row) > 1 and is_data(row)]
    return sum(bool(cell) for row in data for cell in row) if len(data) > 0.8 * len(rows) else 0


def read_text(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every named column of numbers or points in time."""
    text, encoding = decoded(str(path), path.read_bytes())
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not COMMENT.match(line)
    ]
    separator = found_separator(str(path), [line for _, line in lines])
    names, units, first = _header(path, lines, separator)
    data = [line for _, line in lines[first:]]
    cut = lines[-1][0] if _ends_cut(text, data, separator) else None
    data = data[:-1] if cut else data
    sample = "".join(_sample(data))
    decimal = "," if separator != "," and sample.count(",") > sample.count(".") else "."
    table: Any = pd.read_csv(
        io.StringIO("\n".join(data)),
        sep=r"\s+" if separator == " " else separator,
        decimal=decimal,
        names=list(range(len(names) + 1)),
        index_col=False,
        skipinitialspace=True,
        low_memory=False,
        na_values=list(MISSING),
    )
    numbers = [number for number, _ in lines[first:]]
    beyond: Any = pd.to_numeric(table[len(names)], errors="coerce")
    if beyond.notna().any():
        line = numbers[int(beyond.notna().argmax())]
        raise ImportingError(
            f"{path}, line {line} has more than the {len(names)} numbers of the others: mend it, or cut "
            "the file there"
        )
    shown = {"\t": "tab", " ": "blanks"}.get(separator, f"{separator!r}")
    told = f"; line {cut} is cut off in its last cell and left out" if cut else ""
    version = f"text (separator {shown}, decimal {decimal!r}, {encoding}{told})"
    return version, limited(path, _channels(str(path), numbers, table, names, units))


def _ends_cut(text: str, data: Sequence[str], separator: str) -> bool:
    """Whether a file ends within a cell: without an end of line, in one shorter than all above it."""
    if not text.endswith(data[-1]):
        return False
    *above, last = (len(line.rstrip().rpartition(separator)[2]) for line in data)
    return last < min(above, default=0)


def _header(
    path: Path, lines: Sequence[tuple[int, str]], separator: str
) -> tuple[list[str], list[str], int]:
    """Names, units and place of the first line of data; what stands above the names is a preamble."""
    sample = [cells_of(line, separator) for _, line in _sample(lines)]
    data = [cells for cells in sample if is_data(cells)]
    width = Counter(map(len, data)).most_common(1)[0][0]
    check_number(path, width)

    def is_row(cells: Sequence[str]) -> bool:
        return width <= len(cells) <= width + 1 and is_data(cells[:width])  # a comment may follow

    if not is_row(sample[-1]):
        raise ImportingError(
            f"{path}, line {lines[-1][0]} has not the {width} numbers of the lines above: delete it if "
            "it is text or was cut off"
        )
    rows = (cells_of(line, separator) for _, line in lines)
    top = (cells_of(line, separator) for _, line in lines[:SAMPLE])
    named = next((k for k, row in enumerate(top) if sum(meaning(c) is not None for c in row) > 1), 0)
    higher = [*islice(rows, named), *takewhile(lambda cells: not is_row(cells), rows)]
    first, ends_empty = len(higher), not any(cells[-1] for cells in data)
    above = [row for cells in higher for row in _as_wide(cells, width, ends_empty)]
    if not above:
        raise ImportingError(
            f"{path}, line {lines[first][0]}: no line of {width} names stands above the numbers: "
            "add a header"
        )
    names, units = _names_and_units(above)
    several = names.count(X_COLUMN) > 1  # LabVIEW's channels have a column of times each
    for row in higher if several else ():
        if row[0] == UNIT_LABEL and len(row) <= len(names) - names.count(X_COLUMN) + 1:
            told = iter(row[1:])
            units = ["" if name == X_COLUMN else next(told, "") for name in names]
        if row[0] == "Time" and len({*filter(None, row[1:])}) > 1:
            raise ImportingError(
                f"{path}: its channels begin at different times of day ({', '.join(row[1:4])}...): "
                "export it as TDMS"
            )
    for name, count in Counter(names).items():
        if name and count > 1 and name != X_COLUMN:
            raise ImportingError(f"{path}: column {name!r} stands {count} times: rename one of them")
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
    """Of the lines above the data: the last of units, and the one of most known names, or else the last.

    Neither units nor types of numbers are names.
    """
    units = [""] * len(above[0])
    if len(above) > 1:
        units = next((row for row in reversed(above) if _are_units(row)), units)
    typed = [row for row in above if all(map(TYPES.fullmatch, filter(None, row)))]
    rest = [row for row in above if row is not units and row not in typed]
    rest = [row for row in rest if not _are_units(row)] or rest[-1:] or above[-1:]
    names = max(reversed(rest), key=lambda row: sum(meaning(cell) is not None for cell in row))
    return names, ["" if cell == UNIT_LABEL else cell for cell in units]


def _are_units(cells: Sequence[str]) -> bool:
    """Whether at least half of the filled cells are units."""
    filled = [cell for cell in cells if cell]
    return bool(filled) and sum(is_unit(cell) for cell in filled) * 2 >= len(filled)


def _channels(
    file: str, lines: Sequence[int], table: Any, names: Sequence[str], units: Sequence[str]
) -> Iterator[SourceChannel]:
    """The columns; a date goes to the times of day after it, LabVIEW's times to what follows them."""
    date, time = None, None
    several = names.count(X_COLUMN) > 1
    for column, (name, unit) in enumerate(zip(names, units, strict=True)):
        cells = table[column]
        first = str(next(iter(cells.dropna()), ""))
        if name and times.DATE.fullmatch(first):
            date = cells.astype(str)
        elif name and times.is_point(first):
            cells = cells.where(cells.notna(), None)
            if date is not None and times.CLOCK.match(first):
                cells = date + " " + cells
            values, begin = times.seconds(times.points_in_time(f"{file}, {name}", cells))
            yield SourceChannel(name=name, unit="s", values=values, begin=begin)
        elif name == X_COLUMN and several:
            time = _numbers(file, lines, cells, name)
        elif name:
            numbers = _numbers(file, lines, cells, name)
            yield SourceChannel(name=name, unit=unit, values=numbers, time=time)


def _numbers(file: str, lines: Sequence[int], cells: Any, name: str) -> Any:
    """The numbers of a column, (samples,), NaN for a missing one."""
    texts = cells.astype(str).str.replace(",", ".") if cells.dtype.kind not in "iufb" else cells
    numbers: Any = pd.to_numeric(texts, errors="coerce")
    wrong = np.flatnonzero(numbers.isna() & cells.notna())
    if wrong.size:
        cell = str(cells.iloc[wrong[0]])[:40]
        raise ImportingError(
            f"{file}, line {lines[wrong[0]]}: {name} is {cell!r}, not a number: mend the cell, or cut "
            "the file there"
        )
    return numbers.to_numpy(dtype=float)
