"""What the cells of a table say: numbers with units, points in time, readings that are missing."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from identification.importing import times
from identification.importing.source_file import SourceChannel, WrongCell, check_cells, unread
from identification.importing.units import parsed_unit

MISSING = frozenset((
    "NULL", "null", "None", "NaN", "nan", "NAN", "NA", "#NV", "#N/A", "N/A", "n/a", "n.a.", "-", "--",
    "---", "***", "1.#QNAN", "-1.#IND", "#DIV/0!", "#VALUE!", "#WERT!",
))  # fmt: skip
"""Cells that hold no reading, beside empty ones."""

OVER_RANGE = re.compile(
    r"\+{2,}|-{4,}|[+-]?\s?(OL|O\.L\.?|OVLD|OVFL|OVER|OVER[ -]?(LOAD|FLOW|RANGE)|1\.#INF|Inf(inity)?)",
    re.IGNORECASE,
)
"""Cells that say that a reading was beyond the range."""

NUMBER = r"[+-]?\s?(?:\d+(?:[.,'’\s]\d{3})*(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?"
"""A number with a decimal sign and perhaps marks of thousands."""

CELL = re.compile(rf"({NUMBER})\s*([^\W\d_][^;|\t]{{0,11}}|[%°][^;|\t]{{0,3}})?")
"""The same, perhaps with a unit."""

SURE_DECIMAL = re.compile(
    r"[+-]?\s?(?:(?:0|\d{4,})?([.,])\d+|[\d.,'’\s]+([.,])(?:\d{1,2}|\d{4,}))(?:[eE][+-]?\d+)?"
)
"""A number whose last sign is decimal: not three digits follow, or more than three or a 0 precede."""

SURE_THOUSANDS = r"[+-]?[1-9]\d{{0,2}}(?:\{mark}\d{{3}})+"


def is_value(cell: str) -> bool:
    """Whether a cell is a number or a point in time."""
    return bool(CELL.fullmatch(cell) or times.is_point(cell))


def numbers(cells: Any, decimal: str) -> tuple[NDArray, str]:
    """The numbers of a column, (samples,), and the unit that stands in its cells.

    NaN for a missing reading, infinite for one that is over-range. decimal: sign of most of the file's
    numbers. Raises WrongCell.
    """
    if cells.dtype.kind in "iufb":
        return cells.to_numpy(dtype=float), ""
    texts = cells.dropna().astype(str).str.strip()
    over = texts.str.fullmatch(OVER_RANGE)
    values = pd.Series(np.nan, index=cells.index)
    values[texts.index[over]] = np.inf
    texts = texts[~over]
    parts = texts.str.extract(rf"^(?:{CELL.pattern})$").fillna("")
    check_cells(parts[0] != "", texts, "not a number")
    unit = str(next(iter(parts[1]), ""))
    check_cells(parts[1] == unit, texts, f"not a number{f' of the unit {unit!r}' if unit else ''}")
    plain = _plain(parts[0].str.replace(r"[\s'’]", "", regex=True), texts, decimal)
    values[plain.index] = pd.to_numeric(plain)
    return values.to_numpy(dtype=float), unit


def _plain(numbers: Any, texts: Any, decimal: str) -> Any:
    """Numbers with a decimal point and no marks of thousands. Raises WrongCell if they are ambiguous."""
    both = numbers[numbers.str.contains(",", regex=False) & numbers.str.contains(".", regex=False)]
    thousands = "," if decimal == "." else "."
    if len(both):  # the decimal sign stands last
        thousands = min(",.", key=str(both.iloc[0]).rfind)
    marked = numbers[numbers.str.contains(thousands, regex=False)]
    grouped = marked.str.fullmatch(SURE_THOUSANDS.format(mark=thousands) + r"(?:[.,]\d*)?")
    if not len(both) and not (len(marked) and grouped.all()):
        return numbers.str.replace(",", ".")
    check_cells(grouped, texts, "with other marks of thousands than the cells above")
    if not len(both) and not (marked.str.count(re.escape(thousands)) > 1).any():
        found = str(marked.iloc[0])
        one, other = found.replace(thousands, ""), found.replace(",", ".")
        rule = f"which may be {one} or {other}: write it with the decimal sign {decimal!r} alone"
        raise WrongCell(int(marked.index[0]), texts[marked.index[0]], rule)
    return numbers.str.replace(thousands, "", regex=False).str.replace(",", ".")


X_COLUMN = "X_Value"
"""LabVIEW's name of times, also of several columns of times."""


@dataclass(frozen=True, kw_only=True)
class Columns:
    """The samples of a table by column."""

    frame: Any
    """Cells by number of column; the index counts the lines of samples."""
    lines: NDArray
    """Number of each line of samples in the file."""
    decimal: str
    names: Sequence[str]
    units: Sequence[str]

    def channels(self) -> Iterator[SourceChannel]:
        """A date goes to the times of day after it, LabVIEW's times to the channels after them."""
        date, time, used = "", None, -1
        for column, name in enumerate(self.names):
            first = str(next(iter(self.frame[column].dropna()), ""))
            begin, unit = None, "s"
            if not name or column == used:
                continue
            try:
                if times.DATE.fullmatch(first):
                    date = self.frame[column].astype(str) + " "
                    continue
                if times.is_point(first):
                    cells = self.frame[column]
                    points = times.points_in_time(date + cells if times.CLOCK.match(first) else cells)
                    values, begin = times.seconds(points)
                    fraction = self.fraction(column + 1, values)
                    if fraction is not None:
                        values, used = values + fraction, column + 1
                else:
                    values, inside = numbers(self.frame[column], self.decimal)
                    unit = inside or self.units[column]
            except WrongCell as wrong:
                yield unread(name, f"is {wrong} (line {self.lines[wrong.row]}): {MEND}")
                continue
            if name == X_COLUMN and self.names.count(X_COLUMN) > 1:
                time = values
            else:
                lines = self.lines[self.frame.index]
                yield SourceChannel(
                    name=name, unit=unit, values=values, time=time, begin=begin, lines=lines
                )

    def fraction(self, column: int, whole: NDArray) -> NDArray | None:
        """What a column of ms or µs adds to whole seconds before it, (samples,) [s]; None: nothing.

        It begins again with every second, which a time from the start of the recording does not.
        """
        unit = parsed_unit((*self.units, "")[column] or (*self.names, "")[column])
        if unit is None or unit.quantity != "time" or unit.size >= 1.0 or np.any(whole % 1.0):
            return None
        fraction = unit.size * numbers(self.frame[column], self.decimal)[0]
        later = np.diff(whole) > 0.0
        inside = np.nanmin(fraction) >= 0.0 and np.nanmax(fraction) < 1.0 - 1e-9
        return fraction if inside and np.all(np.diff(fraction)[later] < 0.0) else None


MEND = (
    "mend the cell, cut the file there, or name the mark of a missing reading in a mapping file: "
    '{"format": "epv-mapping/1", "missing": ["MARK"]}'
)
"""Remedies for a cell that cannot be read."""
