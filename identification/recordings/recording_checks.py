"""The rules that the signals of a recording keep, each a function that raises CampaignError.

They look at columns in the units of the file (A, V, bar absolute), as `columns` reads them. What is
wrong with a file as a whole comes before what is wrong with single samples, so that the first refusal is
the most helpful one.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.channels import Sensor
from identification.recordings.columns import (
    CHANNEL_OF,
    TIME_COLUMN,
    check_rate,
    line_number,
    sampling_period,
)
from identification.recordings.recording import HOLD, CampaignError
from identification.recordings.rules import RULES, RecordingRules
from identification.recordings.unit_diagnosis import check_units


def check_recording(
    file: str,
    columns: Mapping[str, NDArray],
    *,
    role: str,
    ambient_bar: float,
    steps: Mapping[str, float] | None = None,
    rules: RecordingRules = RULES,
) -> float:
    """Apply every rule to a recording's columns; returns the sampling period [s].

    Args:
        file: what messages call the recording.
        columns: by the file's column names, each (samples,) in the unit of the name.
        role: one of recording.ROLES.
        ambient_bar: p_env [bar absolute].
        steps: coarse steps of the campaign's readings by column [bar]; None: there are none.

    Raises CampaignError at the first rule that is broken.
    """
    period = sampling_period(file, columns[TIME_COLUMN], rules)
    _check_samples(file, columns, role, steps or {})
    if role != "quality" and not switches(columns["U_V"], rules):
        check_length(file, columns, role, period, rules)
        _refuse_voltage(file, columns["U_V"])
    check_units(file, columns, period, ambient_bar, rules)
    check_rate(file, period, rules)
    check_length(file, columns, role, period, rules)
    for name, channel in CHANNEL_OF.items():
        if name in columns:
            coarse = (steps or {}).get(name, 0.0)
            _check_channel(
                file, name, columns[name], rules.sensors[channel], period, ambient_bar, coarse, rules
            )
    if role != "quality":
        check_energised_start(file, columns["U_V"], period)
        check_steady_start(file, columns, period, rules)
    return period


def _check_samples(
    file: str, columns: Mapping[str, NDArray], role: str, steps: Mapping[str, float]
) -> None:
    """Every channel lives: what is dead tells nothing about units. steps: by column [bar]."""
    for name, channel in CHANNEL_OF.items():
        if name in columns and name != "U_V":  # a voltage may be fed back without noise
            coarse = steps.get(name, 0.0)
            check_alive(file, name, columns[name], may_rest=_may_rest(coarse, channel, role))


def _check_channel(
    file: str,
    name: str,
    values: NDArray,
    sensor: Sensor,
    period: float,
    ambient_bar: float,
    coarse: float,
    rules: RecordingRules,
) -> None:
    check_range(file, name, values, sensor)
    vented = coarse > 0 and abs(ambient_bar - sensor.low) <= _margin(sensor)
    check_rail(file, name, values, sensor, period, rules, low_end=not vented)


def check_length(
    file: str, columns: Mapping[str, NDArray], role: str, period: float, rules: RecordingRules
) -> None:
    """A recording holds its steady start and more; one for statistics `rules.least_rest`.

    columns: by name, each (samples,) in the unit of the name. Raises CampaignError.
    """
    samples = len(columns[TIME_COLUMN])
    needed = _samples(rules.least_rest, period) if role == "quality" else _samples(HOLD, period) + 1
    if samples < needed:
        raise CampaignError(
            f"{file}, line {line_number(samples)}: the file ends after {samples} samples, and a {role} "
            "recording "
            f"at {1 / period:g} Hz needs at least {needed}: record for longer"
        )


def check_alive(file: str, name: str, values: NDArray, *, may_rest: bool = False) -> None:
    """Noise and the ADC's steps move every channel, (samples,) [A, V or bar], that is connected.

    may_rest: whether the readings' step is so coarse that a live channel may read the same throughout.
    """
    if np.min(values) == np.max(values) and not may_rest:
        raise CampaignError(
            f"{file}, {_lines(0, len(values))}: {name} is {values[0]:g} throughout, and noise moves "
            "every live channel: check its sensor, or give simulated data the sensors' noise"
        )


def check_range(file: str, name: str, values: NDArray, sensor: Sensor) -> None:
    """Values (samples,) [the sensor's unit] lie in Table 1's range, but for the accuracy."""
    margin = _margin(sensor) + 1e-9
    outside = (values < sensor.low - margin) | (values > sensor.high + margin)
    if np.any(outside):
        sample = int(np.argmax(outside))
        raise CampaignError(
            f"{file}, line {line_number(sample)}: {name} is {values[sample]:g}, outside the sensor's "
            "range "
            f"[{sensor.low:g}, {sensor.high:g}] by more than its accuracy of {_margin(sensor):g}: "
            "check unit and scaling, or cut the recording there"
        )


def check_rail(
    file: str,
    name: str,
    values: NDArray,
    sensor: Sensor,
    period: float,
    rules: RecordingRules,
    *,
    low_end: bool = True,
) -> None:
    """No reading (samples,) [A, V, bar] stays at an end of the range, or where the ADC saturates.

    low_end: whether the range's low end counts; a vented chamber in coarse steps stays there.
    """
    at_end = (low_end & (values <= sensor.low)) | (values >= sensor.high - sensor.resolution)
    first, length = _longest_run(at_end[1:] & (values[1:] == values[:-1]))
    if length >= max(_samples(rules.stuck_time, period), rules.stuck_samples):
        raise CampaignError(
            f"{file}, {_lines(first, length + 1)}: {name} is stuck at {values[first]:g}, an end of the "
            f"sensor's range [{sensor.low:g}, {sensor.high:g}]: check the sensor, or record again with "
            "signals inside the range"
        )


def switches(U: NDArray, rules: RecordingRules) -> bool:
    """Whether a coil, at voltages (samples,) in any unit, is on and off: around half the greatest.

    Noise does not switch: its samples differ from each other by nearly as much as from the mean.
    """
    size, noise = np.abs(U), np.quantile(np.abs(np.diff(U)), 0.9)
    return bool(np.min(size) < 0.5 * np.max(size) and np.ptp(U) > rules.switching_noise * noise)


def _refuse_voltage(file: str, U: NDArray) -> None:
    raise CampaignError(
        f"{file}, {_lines(0, len(U))}: U_V never switches, it stays between {np.min(U):g} and "
        f"{np.max(U):g} V: record a switching of the coil, or give the recording the role quality"
    )


def check_energised_start(file: str, U: NDArray, period: float) -> None:
    """The coil, at voltages (samples,) [V], is on for HOLD before it first switches."""
    off = np.flatnonzero(0.5 * np.max(U) >= U[: _samples(HOLD, period)])
    if off.size:
        raise CampaignError(
            f"{file}, line {line_number(off[0])}: U_V is {U[off[0]]:g} V at {1e3 * off[0] * period:g} "
            "ms, and "
            f"recordings start energised for at least {1e3 * HOLD:g} ms: record from before the first "
            "switching"
        )


def check_steady_start(
    file: str, columns: Mapping[str, NDArray], period: float, rules: RecordingRules = RULES
) -> None:
    """Current and pressures rest during HOLD: first and last quarter agree within the accuracy.

    columns: by name, each (samples,) in the unit of the name. period [s]. Raises CampaignError.
    """
    count = _samples(HOLD, period)
    quarter = count // 4
    for name, channel in CHANNEL_OF.items():
        if name in columns and name != "U_V":
            start = columns[name][:count]
            change = float(np.mean(start[-quarter:]) - np.mean(start[:quarter]))
            if abs(change) > _margin(rules.sensors[channel]):
                raise CampaignError(
                    f"{file}, {_lines(0, count)}: {name} changes by {change:g} in the first "
                    f"{1e3 * HOLD:g} ms, which must be steady: let the bench settle, energised, "
                    "before recording"
                )


def _may_rest(coarse: float, channel: str, role: str) -> bool:
    """Whether a live channel may read the same throughout, in coarse steps [bar]; 0 for fine ones.

    The supply may, and any pressure of a steady record; p2 and p3 move when the coil switches.
    """
    return coarse > 0 and (channel == "p1" or role == "quality")


def _margin(sensor: Sensor) -> float:
    """Accuracy in the sensor's unit."""
    return sensor.accuracy * sensor.high


def _samples(duration: float, period: float) -> int:
    """Samples that a duration [s] holds."""
    return int(np.ceil(duration / period - 1e-6))


def _lines(first: int, count: int) -> str:
    return f"lines {line_number(first)} to {line_number(first + count - 1)}"


def _longest_run(mask: NDArray) -> tuple[int, int]:
    """First index and length of the longest run of true in a boolean array (samples,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    lengths = edges[1::2] - edges[::2]
    if not lengths.size:
        return 0, 0
    longest = int(np.argmax(lengths))
    return int(edges[2 * longest]), int(lengths[longest])
