"""The dialect of a text file with columns of numbers: encoding, separator and decimal sign."""

import codecs
import csv
from collections.abc import Sequence
from dataclasses import dataclass

from identification.importing.formats.source_file import ImportingError
from identification.importing.formats.time_stamps import STAMP

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
