"""Times of samples as files write them: points in time, times of day, and what they begin with."""

import re
from collections.abc import Iterable

import numpy as np
import pandas as pd
from dateutil.parser import parse
from numpy.typing import NDArray

from identification.importing.source_file import check_cells

ISO = re.compile(r"\d{4}-?\d\d-?\d\d[T ]\d\d")
"""Beginning of a date with a time of day (ISO 8601); a blank may stand for T."""

MONTH = r"(?:jan|feb|m[aä]r|apr|ma[iy]|jun|jul|aug|sep|o[ck]t|nov|de[cz])[a-z]*\.?"
GERMAN = {"mär": "mar", "mai": "may", "okt": "oct", "dez": "dec"}
"""Names of months, English and German; German beginnings that differ."""

DATE = re.compile(
    r"\d{4}[-/.]\d\d?[-/.]\d\d?|\d\d?[-/.]\d\d?[-/.](?:\d{4}|\d\d)"
    rf"|\d\d?[-/. ]*{MONTH}[-/., ]*(?:\d{{4}}|\d\d)|{MONTH}[-/ ]*\d\d?[-/, ]+\d{{4}}",
    re.IGNORECASE,
)
"""A date alone. Only differences count."""

CLOCK = re.compile(r"(\d\d?:\d\d:\d\d(?:[.,:]\d+)?)(?:\s?([ap])\.?m\.?)?", re.IGNORECASE)
"""A time of day, perhaps with milliseconds after a colon, and with AM or PM."""

LOCAL = re.compile(rf"(?:({DATE.pattern})[T,\s]\s*)?{CLOCK.pattern}", re.IGNORECASE)
"""The same with or without a date before it."""

HOUR = 3_600_000_000_000
"""[ns]."""


def is_point(cell: str) -> bool:
    """Whether a text begins as a point in time, or is a date or a time of day."""
    return bool(ISO.match(cell) or DATE.fullmatch(cell) or LOCAL.fullmatch(cell))


def points_in_time(texts: pd.Series) -> NDArray:
    """Texts as points in time, datetime64[ns], NaT where one is missing.

    ISO 8601 in UTC where it names a zone; else date and time of day as Germans and Americans write them.
    Times of day without a date count from 1970 and go on after midnight. Raises WrongCell.
    """
    cells = texts.dropna().astype(str)
    points = pd.Series(np.datetime64("NaT"), index=texts.index, dtype="datetime64[ns]")
    iso = pd.to_datetime(cells.str.replace(",", "."), format="ISO8601", utc=True, errors="coerce")
    if iso.notna().any():
        check_cells(iso.notna(), cells, RULE)
        points[cells.index] = iso.dt.tz_localize(None).astype("datetime64[ns]")
    elif len(cells):
        points[cells.index] = _local_points(cells)
    return points.to_numpy()


RULE = "not a point in time: write it as 2026-03-01T10:00:00.0005"


def _local_points(cells: pd.Series) -> NDArray:
    """Dates and times of day, (samples,). Raises WrongCell."""
    parts = cells.str.extract(f"^{LOCAL.pattern}$", flags=re.IGNORECASE)
    check_cells(parts[1].notna(), cells, RULE)
    clock = parts[1].str.replace(r"(:\d\d:\d\d):(\d+)", lambda m: f"{m[1]}.{m[2]:0>3}", regex=True)
    time = pd.to_timedelta(clock.str.replace(",", ".")).to_numpy("m8[ns]").astype(np.int64)
    half = parts[2].str.lower()
    time = np.where(half.notna(), time % (12 * HOUR) + 12 * HOUR * half.eq("p"), time)
    dates = parts[0].dropna().unique()
    orders = ("." in dates[0], "." not in dates[0]) if len(dates) else ()  # a dot follows the day
    both = [_days(dates, day_first) for day_first in orders]
    # A recording is short, if day and month are read right.
    days = min(both, key=lambda found: max(found.values()) - min(found.values()), default={})
    day = parts[0].map(days).astype("datetime64[ns]")
    check_cells(parts[0].isna() | day.notna(), cells, RULE)
    stamps = day.fillna(pd.Timestamp(0)).to_numpy("M8[ns]").astype(np.int64) + time
    return _unwound(stamps, time // HOUR, marked=half.notna().any(), dated=len(dates) > 0).view("M8[ns]")


def _days(dates: Iterable[str], day_first: bool) -> dict[str, pd.Timestamp]:
    """The dates by their texts, NaT for one that is none."""
    days = {}
    for text in dates:
        english = re.sub(
            MONTH, lambda m: GERMAN.get(m[0][:3].lower(), m[0][:3]), text, flags=re.IGNORECASE
        )
        try:
            days[text] = pd.Timestamp(parse(english, dayfirst=day_first).date())
        except ValueError:
            days[text] = pd.NaT
    return days


def _unwound(stamps: NDArray, hours: NDArray, *, marked: bool, dated: bool) -> NDArray:
    """Stamps that go on after midnight, and after 12:59 on a clock of twelve hours.

    Args:
        stamps: (samples,) [ns].
        hours: that the clock shows, (samples,).
        marked: whether AM and PM tell the halves of the day.
        dated: whether the stamps have dates.
    """
    jumps = np.abs(np.diff(stamps)) > 6 * HOUR
    twelve = not marked and hours.min() >= 1 and hours.max() <= 12
    if twelve and np.isin(hours[1:][jumps], (12, 1)).all():
        return np.unwrap(stamps, period=12 * HOUR)
    return stamps if dated else np.unwrap(stamps, period=24 * HOUR)


def seconds(values: NDArray) -> tuple[NDArray, np.datetime64 | None]:
    """Numbers as they are; points in time in seconds from the first, (samples,), and that."""
    if values.dtype.kind != "M":
        return np.asarray(values, dtype=float), None
    known = values[~np.isnat(values)]
    begin = known[0] if len(known) else np.datetime64("NaT")
    return (values - begin) / np.timedelta64(1, "s"), begin
