"""The sampling of a recording: uniform up to the digits in which its times are printed."""

import numpy as np
from numpy.typing import NDArray

from identification.recordings.columns import TIME_COLUMN, line_number
from identification.recordings.recording import CampaignError
from identification.recordings.rules import RULES, RecordingRules


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
