"""Times of samples as files write them: points in time, times of day, wrapped counters, bad stamps."""

import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from identification.importing.source_file import ImportingError

ISO = re.compile(r"\d{4}-?\d\d-?\d\d[T ]\d\d")
"""Beginning of a date with a time of day (ISO 8601); a blank may stand for T."""

DATE = re.compile(r"\d{4}[-/.]\d\d?[-/.]\d\d?|\d\d?[-/.]\d\d?[-/.](\d{4}|\d\d)")
"""A date alone. Only differences count."""

DAY_FIRST = re.compile(r"\d\d?\.|(1[3-9]|[23]\d)[-/]")
"""Beginning of a date with the day before the month: a dot follows, or no month is so late."""

CLOCK = re.compile(r"(\d\d?:\d\d:\d\d(?:[.,]\d+)?)(?:\s?([AaPp])\.?[Mm]\.?)?")
"""A time of day, perhaps with AM or PM."""

LOCAL = rf"(?:({DATE.pattern})[T ]\s*)?{CLOCK.pattern}"
"""The same with or without a date before it."""

HALF_DAY = np.timedelta64(12, "h")

COUNTERS = (2**16, 2**32)
"""Values after which counters of time begin again at 0."""

MOST_BAD = 0.01
"""Share of stamps that may stand out of their neighbours' order and count as missing."""


def is_point(cell: str) -> bool:
    """Whether a text begins as a point in time, or is a date or a time of day."""
    return bool(ISO.match(cell) or DATE.fullmatch(cell) or re.fullmatch(LOCAL, cell))


def points_in_time(place: str, texts: Iterable[Any]) -> NDArray:
    """Texts as points in time, datetime64[ns], NaT for an empty text.

    ISO 8601 in UTC where it names a zone; else date and time of day as Germans and Americans write them.
    Times of day without a date count from 1970 and go on after midnight. place: begins the message.
    Raises ImportingError for a text that is no point in time.
    """
    cells = pd.Series(["" if pd.isna(text) else str(text) for text in texts], dtype=str)
    cells = cells.str.replace(",", ".")
    try:
        if not ISO.match(next(filter(None, cells), "")):
            return _local_points(cells)
        zoned = pd.to_datetime(cells, format="ISO8601", utc=True)
        return zoned.dt.tz_localize(None).to_numpy("M8[ns]")
    except ValueError as error:
        raise ImportingError(
            f"{place} has no point in time ({str(error).partition('. ')[0]}): write it as "
            "2026-03-01T10:00:00.0005"
        ) from None


def _local_points(cells: pd.Series) -> NDArray:
    """Dates and times of day, (samples,). Raises ValueError."""
    parts = cells.str.extract(f"^{LOCAL}$").to_numpy(dtype=object)
    date, clock, half = (pd.Series(parts[:, k]) for k in (0, 2, 3))
    wrong = np.flatnonzero(clock.isna() & (cells != ""))
    if wrong.size:
        raise ValueError(cells.iloc[wrong[0]])
    time = pd.to_timedelta(clock).to_numpy("m8[ns]")
    twelve = half.notna().to_numpy()
    time[twelve] = time[twelve] % HALF_DAY + half.str.lower().eq("p").to_numpy()[twelve] * HALF_DAY
    if date.notna().any():
        days = {t: pd.to_datetime(t, dayfirst=bool(DAY_FIRST.match(t))) for t in date.dropna().unique()}
        return date.map(days).to_numpy("M8[ns]") + time
    known = ~np.isnat(time)
    time[known] = np.unwrap(
        time[known].astype(np.int64), period=int(2 * HALF_DAY / np.timedelta64(1, "ns"))
    )
    return np.datetime64(0, "ns") + time


def seconds(values: NDArray) -> tuple[NDArray, np.datetime64 | None]:
    """Numbers as they are, durations in seconds, points in time in seconds from the first; and that one.

    values: (samples,) numbers, timedelta64 or datetime64; the first point in time is None for others.
    """
    second = np.timedelta64(1, "s")
    if values.dtype.kind == "m":
        return values / second, None
    if values.dtype.kind != "M":
        return np.asarray(values, dtype=float), None
    known = values[~np.isnat(values)]
    begin = known[0] if len(known) else np.datetime64("NaT")
    return (values - begin) / second, begin


def in_order(stamps: NDArray) -> NDArray:
    """Stamps (samples,) in their unit: NaN where a single one breaks the order; wraps are unwound."""
    before, at, after = stamps[:-2], stamps[1:-1], stamps[2:]
    bad = np.flatnonzero((before < after) & ((at < before) | (at > after))) + 1
    stamps = stamps.copy()
    if bad.size <= MOST_BAD * len(stamps):
        stamps[bad] = np.nan
    known = np.isfinite(stamps)
    for size in COUNTERS:
        if np.any(known) and np.min(stamps[known]) >= 0 and np.max(stamps[known]) < size:
            unwound = np.unwrap(stamps[known], period=size)
            if np.all(np.diff(unwound) > 0):
                stamps[known] = unwound
                break
    return stamps


def begin_offsets(place: str, begins: Sequence[np.datetime64 | None]) -> list[float]:
    """What to add to the times of channels so that they count from one point in time [s].

    place: begins the message. begins: the point in time of each channel's zero; None: not known. Raises
    ImportingError if it is known of some channels only.
    """
    known = [begin for begin in begins if begin is not None]
    if known and len(known) < len(begins):
        raise ImportingError(
            f"{place}: some channels have points in time and others only times from a start that the "
            "file does not tell: export all with the same kind of time"
        )
    first = min(known) if known else np.datetime64(0, "s")
    return [float((begin - first) / np.timedelta64(1, "s")) for begin in known] or [0.0] * len(begins)
