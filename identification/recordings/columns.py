"""The columns of a recording's CSV file: the number in every cell, and the sampling of the times."""

import csv
import io
import math
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.channels import CHANNEL, P1
from identification.recordings.recording import CHANNELS, CampaignError
from identification.recordings.rules import RULES, RecordingRules

TIME_COLUMN, CONSUMPTION_COLUMN = "time_s", "sigmaS_kg_per_s"
"""Columns that are no channel: time [s] and consumed air [kg/s]."""

CHANNEL_OF: Mapping[str, str] = {column: name for name in CHANNELS for column in CHANNEL[name].columns}
"""Measured channel (recording.CHANNELS) in each column, in the unit of its name."""

REQUIRED_COLUMNS = (
    TIME_COLUMN,
    *(CHANNEL[name].columns[0] for name in CHANNELS if len(CHANNEL[name].columns) == 1),
)
"""Columns without which a file is refused."""

SUPPLY_COLUMNS = (P1.columns[:1], P1.columns[1:])
"""The two ways to give p1: one column, or the two reservoirs' sensors."""

KNOWN_COLUMNS = (TIME_COLUMN, *CHANNEL_OF, CONSUMPTION_COLUMN)
"""Columns that are read; others are ignored."""


def line_number(sample: int) -> int:
    """Number of a sample's line in its file; the header is line 1."""
    return sample + 2


def read_columns(file: str, content: bytes) -> dict[str, NDArray]:
    """The known columns of a CSV file (RFC 4180, UTF-8), each (samples,), in the order of the file.

    file: what messages call it. The unit of each column is in its name. Columns that are not
    KNOWN_COLUMNS are ignored. Raises CampaignError.
    """
    text = _decoded(file, content)
    names = _column_names(file, text)
    wanted = [index for index, name in enumerate(names) if name in KNOWN_COLUMNS]
    values = _parsed_at_once(text, len(names), wanted)
    if values is None:
        values = _parsed_by_line(file, text, names, wanted)
    return {names[index]: values[:, place].copy() for place, index in enumerate(wanted)}


def _decoded(file: str, content: bytes) -> str:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place = content.count(b"\n", 0, error.start) + 1
        raise CampaignError(
            f"{file}, line {place}: a byte is not UTF-8: save the file as CSV in UTF-8"
        ) from None
    return text.replace("\r\n", "\n").rstrip("\n")


def _column_names(file: str, text: str) -> list[str]:
    try:
        header = next(csv.reader(io.StringIO(text), strict=True), [])
    except csv.Error as error:
        raise CampaignError(f"{file}, line 1: not CSV ({error}): write the header anew") from None
    names = [name.strip() for name in header]
    _check_names(f"{file}, line 1", names)
    return names


def _check_names(place: str, names: Sequence[str]) -> None:
    for name, count in Counter(names).items():
        if count > 1:
            raise CampaignError(f"{place}: column {name!r} stands twice: keep one of them")
    missing = [name for name in REQUIRED_COLUMNS if name not in names]
    if missing:
        raise CampaignError(
            f"{place}: missing {', '.join(missing)} in the header {','.join(names)[:120]!r}: "
            "name these columns as docs/reference/files.md does, separated by commas"
        )
    given = tuple(name for way in SUPPLY_COLUMNS for name in way if name in names)
    if given not in SUPPLY_COLUMNS:
        raise CampaignError(
            f"{place}: p1 is given by {' and '.join(given) or 'no column'}: "
            "give p1_bar, or both p1a_bar and p1b_bar, not a mixture"
        )


def _parsed_at_once(text: str, width: int, wanted: Sequence[int]) -> NDArray | None:
    """All numbers, (samples, wanted), or None where only a closer look can tell."""
    rows = text.split("\n")[1:]
    if '"' in text or not rows or any(row.count(",") != width - 1 for row in rows):
        return None
    try:
        values = np.loadtxt(rows, delimiter=",", comments=None, usecols=wanted, ndmin=2)
    except ValueError:
        return None
    return values if np.all(np.isfinite(values)) else None


def _parsed_by_line(file: str, text: str, names: Sequence[str], wanted: Sequence[int]) -> NDArray:
    """The same, slowly; the first line that breaks a rule is named."""
    reader = csv.reader(io.StringIO(text), strict=True)
    values: list[list[float]] = []
    try:
        next(reader, None)
        for row in reader:
            values.append(_row(f"{file}, line {reader.line_num}", row, names, wanted))
    except csv.Error as error:
        raise CampaignError(
            f"{file}, line {reader.line_num}: not CSV ({error}): write this line anew"
        ) from None
    return np.reshape(np.array(values, dtype=float), (-1, len(wanted)))


def _row(place: str, row: Sequence[str], names: Sequence[str], wanted: Sequence[int]) -> list[float]:
    if len(row) != len(names):
        raise CampaignError(
            f"{place}: {len(row)} cells stand under {len(names)} column names: "
            "give every column one cell, with '.' as decimal sign"
        )
    return [_number(f"{place}: {names[index]}", row[index]) for index in wanted]


def _number(place: str, cell: str) -> float:
    try:
        value = math.nan if "_" in cell else float(cell)  # Python's own 1_000 is no CSV number
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        shown = repr(cell[:40]) if cell.strip() else "empty"
        raise CampaignError(
            f"{place} is {shown}, not a finite number: give one with '.' as decimal sign, or cut the "
            "recording before this line"
        )
    return value


def sampling_period(file: str, time: NDArray, rules: RecordingRules = RULES) -> float:
    """Time between samples [s] of a `time_s` column, (samples,).

    Of all periods that explain the printed times the one with the roundest rate in Hz; their middle
    where no whole rate does. Raises CampaignError for times that are not uniform or do not start at 0.
    """
    if len(time) < 2:
        raise CampaignError(
            f"{file}, line {line_number(len(time))}: the file ends after {len(time)} samples, too few "
            "to tell "
            "the sampling rate: record for longer"
        )
    _check_order(file, time)
    _check_gaps(file, time)
    least, greatest = _explaining_periods(time, rules)
    if least > greatest:
        _refuse_jitter(file, time)
    period = _roundest(least, greatest)
    return period


def check_rate(file: str, period: float, rules: RecordingRules = RULES) -> None:
    """Samples follow each other fast enough; period [s]. Raises CampaignError."""
    if period * rules.least_rate > 1 + 1e-9:
        raise CampaignError(
            f"{file}, line {line_number(1)}: sampled at {1 / period:g} Hz: record at "
            f"{rules.least_rate:g} Hz or faster"
        )


def _check_order(file: str, time: NDArray) -> None:
    if abs(time[0]) > 1e-9:
        raise CampaignError(
            f"{file}, line {line_number(0)}: {TIME_COLUMN} starts at {time[0]:g} and must start at 0: "
            "subtract the "
            "first time from all"
        )
    backward = np.flatnonzero(np.diff(time) <= 0)
    if backward.size:
        rule = "must increase: sort the samples, give each once, or print more digits"
        _refuse_step(file, time, backward[0], rule)


def _check_gaps(file: str, time: NDArray) -> None:
    steps = np.diff(time)
    usual = float(np.median(steps))
    odd = np.flatnonzero(np.abs(steps - usual) > 0.5 * usual + 1e-9)
    if odd.size:
        rule = f"must be uniform, in steps of {usual:g}: cut the recording there, or print more digits"
        _refuse_step(file, time, odd[0], rule)


def _refuse_step(file: str, time: NDArray, sample: int, rule: str) -> None:
    raise CampaignError(
        f"{file}, line {line_number(sample + 1)}: {TIME_COLUMN} goes from {time[sample]:.9g} to "
        f"{time[sample + 1]:.9g} and {rule}"
    )


def _refuse_jitter(file: str, time: NDArray) -> None:
    uniform = np.linspace(0.0, time[-1], len(time))
    worst = int(np.argmax(np.abs(time - uniform)))
    raise CampaignError(
        f"{file}, line {line_number(worst)}: {TIME_COLUMN} is {time[worst]:.9g} where uniform "
        "sampling has "
        f"{uniform[worst]:.9g}, which rounding to the printed digits does not explain: resample to a "
        "uniform rate"
    )


def _explaining_periods(time: NDArray, rules: RecordingRules) -> tuple[float, float]:
    """Ends of the range of periods with which every time is right up to its rounding [s].

    Time k, rounded by at most h, allows (t_k - h) / k to (t_k + h) / k; the first end lies above the
    second where nothing explains all.
    """
    rounding = 0.5 * _last_digit(time, rules.most_digits) + rules.harmless_jitter * float(
        np.median(np.diff(time))
    )
    count = np.arange(1, len(time))
    return (
        float(np.max((time[1:] - rounding) / count)),
        float(np.min((time[1:] + rounding) / count)),
    )


def _last_digit(time: NDArray, most_digits: int) -> float:
    """Value of the last decimal in which times are printed [s]."""
    for digits in range(most_digits):
        if np.max(np.abs(time - np.round(time, digits))) < 1e-12:
            return 10.0**-digits
    return 10.0**-most_digits


def _roundest(least: float, greatest: float) -> float:
    """Of a range of periods the one with the roundest rate, or the middle [s]."""
    middle = 0.5 * (least + greatest)
    for unit in (1000, 100, 10, 1):
        rate = unit * round(1 / (middle * unit))
        if rate > 0 and least <= 1 / rate <= greatest:
            return 1 / rate
    return middle
