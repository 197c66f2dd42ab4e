"""The columns of a recording's CSV file: the number in every cell, and the sampling of the times."""

import io
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from epv_env.plant.channels import CHANNEL, P1
from identification.recordings.recording import CHANNELS, CampaignError

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

LEAST_RATE = 500.0
"""Least sampling rate [1/s]: a slower bench misses the armature's movement."""

HARMLESS_JITTER = 1e-3
"""Part of a period by which a sample may be off; the steepest signal then moves by less than noise."""

MOST_COLUMNS = 1000
"""A table of more columns would take minutes to read."""

MOST_DIGITS = 9
"""Most decimals of a second with which files print times."""


def line_number(sample: Any) -> Any:
    """Number of a sample's line in its file, or of each of several; the header is line 1."""
    return sample + 2


@dataclass(frozen=True, kw_only=True)
class Place:
    """What messages call a recording and its samples."""

    file: str
    lines: NDArray | None = None
    """Line of each sample, (samples,); None: the header is line 1."""
    period: float | None = None
    """Between samples [s], where the file has no lines: messages then tell times."""

    def __str__(self) -> str:
        return self.file

    def samples(self, first: int, last: int | None = None) -> str:
        """As in "a.csv, lines 3 to 9", or "a.csv, line 3" for one sample."""
        ends = [first] if last is None else [first, last]
        if self.period is not None:
            return f"{self.file}, {' to '.join(f'{end * self.period:.6g}' for end in ends)} s"
        lines = [line_number(end) if self.lines is None else self.lines[end] for end in ends]
        return f"{self.file}, line{'s' * (len(lines) - 1)} {' to '.join(map(str, lines))}"


def read_columns(
    file: str, content: bytes, required: Sequence[str], optional: Collection[str] = ()
) -> dict[str, NDArray]:
    """These columns of a CSV file (RFC 4180, UTF-8), each (samples,), in the order of the file.

    file: what messages call it. The unit of each column is in its name. Other columns are ignored.
    Raises CampaignError.
    """
    cells = _cells(file, content)
    names = [name.strip() for name in cells.iloc[0].fillna("")] if len(cells) else []
    for name, count in Counter(names).items():
        if count > 1:
            raise CampaignError(f"{file}, line 1: column {name!r} stands twice: keep one of them")
    missing = [name for name in required if name not in names]
    if missing:
        raise CampaignError(
            f"{file}, line 1: missing {', '.join(missing)} in the header {','.join(names)[:120]!r}: "
            "name these columns as docs/reference/files.md does, separated by commas"
        )
    return {
        name: _numbers(file, name, cells.iloc[1:, place])
        for place, name in enumerate(names)
        if name in required or name in optional
    }


def _cells(file: str, content: bytes) -> pd.DataFrame:
    """Every cell as text, the header in the first row; NaN where a line ends early."""
    try:
        text = content.decode("utf-8-sig").rstrip()
        if (count := text.partition("\n")[0].count(",") + 1) > MOST_COLUMNS:
            raise CampaignError(
                f"{file}, line 1: {count} columns: leave out what docs/reference/files.md does not name"
            )
        return pd.read_csv(
            io.StringIO(text), header=None, dtype=object, keep_default_na=False, skip_blank_lines=False
        )
    except UnicodeDecodeError as error:
        place = content.count(b"\n", 0, error.start) + 1
        raise CampaignError(
            f"{file}, line {place}: a byte is not UTF-8: save the file as CSV in UTF-8"
        ) from None
    except pd.errors.EmptyDataError:
        return pd.DataFrame()
    except pd.errors.ParserError as error:
        found = re.search(r"(?:line|row) (\d+)", str(error))
        place = f", line {found[1]}" if found else ""
        reason = str(error).strip().removeprefix("Error tokenizing data. C error: ")
        raise CampaignError(
            f"{file}{place}: not CSV ({reason}): give every column one cell, with '.' as decimal sign"
        ) from None


def _numbers(file: str, name: str, cells: pd.Series) -> NDArray:
    """The numbers of a column's cells, (samples,); the first cell without one is named."""
    values = np.asarray(pd.to_numeric(cells, errors="coerce"), dtype=float)
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        cell = cells.iloc[wrong[0]]
        shown = repr(cell[:40]) if isinstance(cell, str) and cell.strip() else "empty"
        raise CampaignError(
            f"{file}, line {line_number(wrong[0])}: {name} is {shown}, not a finite number: give one "
            "with '.' as decimal sign, or cut the recording before this line"
        )
    return values


def sampling_period(file: str, time: NDArray) -> float:
    """Time between samples [s] of a `time_s` column, (samples,).

    Of all periods that explain the printed times the one with the roundest rate in Hz; their middle
    where no whole rate does. Raises CampaignError for times that are not uniform or do not start at 0.
    """
    if len(time) < 2:
        raise CampaignError(
            f"{file}, line {line_number(len(time))}: the file ends after {len(time)} samples, too few "
            "to tell the sampling rate: record for longer"
        )
    if abs(time[0]) > 1e-9:
        raise CampaignError(
            f"{file}, line {line_number(0)}: {TIME_COLUMN} starts at {time[0]:g} and must start at 0: "
            "subtract the first time from all"
        )
    usual = _usual_step(file, time)
    # Time k, rounded by at most h, allows (t_k - h) / k to (t_k + h) / k.
    rounding, count = 0.5 * last_digit(time) + HARMLESS_JITTER * usual, np.arange(1, len(time))
    least, greatest = np.max((time[1:] - rounding) / count), np.min((time[1:] + rounding) / count)
    if least > greatest:
        uniform = np.linspace(0.0, time[-1], len(time))
        worst = int(np.argmax(np.abs(time - uniform)))
        raise CampaignError(
            f"{file}, line {line_number(worst)}: {TIME_COLUMN} is {time[worst]:.9g} where uniform "
            f"sampling has {uniform[worst]:.9g}, which rounding to the printed digits does not explain: "
            "resample to a uniform rate"
        )
    return roundest(float(least), float(greatest))


def _usual_step(file: str, time: NDArray) -> float:
    """Median step of times [s]. Raises CampaignError where one goes back or skips samples."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    backward = np.flatnonzero(steps <= 0)
    odd = np.flatnonzero(np.abs(steps - usual) > 0.5 * usual + 1e-9)
    if not backward.size and not odd.size:
        return usual
    if backward.size:
        sample, rule = backward[0], "increase: sort the samples, give each once, or print more digits"
    else:
        sample = odd[0]
        rule = f"be uniform, in steps of {usual:g}: cut the recording there, or print more digits"
    raise CampaignError(
        f"{file}, line {line_number(sample + 1)}: {TIME_COLUMN} goes from {time[sample]:.9g} to "
        f"{time[sample + 1]:.9g} and must {rule}"
    )


def check_rate(place: Place, period: float) -> None:
    """Samples follow each other fast enough; period [s]. Raises CampaignError."""
    if period * LEAST_RATE > 1 + 1e-9:
        raise CampaignError(
            f"{place.samples(1)}: sampled at {1 / period:g} Hz: record at {LEAST_RATE:g} Hz or faster"
        )


def last_digit(time: NDArray) -> float:
    """Value of the last decimal in which times (samples,) are printed [s]."""
    for digits in range(MOST_DIGITS):
        if np.max(np.abs(time - np.round(time, digits))) < 1e-12:
            return 10.0**-digits
    return 10.0**-MOST_DIGITS


def roundest(least: float, greatest: float) -> float:
    """Of a range of periods the one with the roundest rate, or the middle [s]."""
    middle = 0.5 * (least + greatest)
    for unit in (1000, 100, 10, 1):
        rate = unit * round(1 / (middle * unit))
        if rate > 0 and least <= 1 / rate <= greatest:
            return 1 / rate
    return middle
