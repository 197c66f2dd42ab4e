"""Points in time (ISO 8601) and durations as seconds."""

import re
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.importing.formats.source_file import ImportingError

STAMP = re.compile(
    r"(\d{4})-?(\d\d)-?(\d\d)[T ](\d\d):?(\d\d)(?::?(\d\d(?:[.,]\d+)?))?\s*(?:Z|([+-])(\d\d):?(\d\d)?)?"
)
"""A date with a time of day, in extended or basic form, perhaps with a zone; a blank may stand for T."""


def points_in_time(place: str, texts: Iterable[str | None]) -> NDArray:
    """Texts as points in time, datetime64[ns], UTC where they name a zone; NaT for an empty text.

    place: begins the message. Raises ImportingError for a text that is no point in time.
    """
    return np.array([_point(place, text) if text else "NaT" for text in texts], "datetime64[ns]")


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
    return [float((begin - min(known)) / np.timedelta64(1, "s")) for begin in known] or [0.0] * len(
        begins
    )


def _point(place: str, text: str) -> np.datetime64:
    found = STAMP.fullmatch(text)
    if found is None:
        raise ImportingError(
            f"{place} has {text[:40]!r}, which is no point in time: write it as 2026-03-01T10:00:00.0005"
        )
    year, month, day, hour, minute, second, sign, zone_hour, zone_minute = found.groups()
    second = (second or "00").replace(",", ".")
    try:
        local = np.datetime64(f"{year}-{month}-{day}T{hour}:{minute}:{second}", "ns")
    except ValueError:
        raise ImportingError(
            f"{place} has {text[:40]!r}, a day or time that does not exist: mend it"
        ) from None
    minutes = 60 * int(zone_hour or 0) + int(zone_minute or 0)
    return local - np.timedelta64(-minutes if sign == "-" else minutes, "m")
