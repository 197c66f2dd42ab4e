"""The rules that the signals of a recording keep.

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
    Place,
    check_rate,
    sampling_period,
)
from identification.recordings.plausibility import check_units, clipped, switches
from identification.recordings.recording import HOLD, RULES, CampaignError, RecordingRules

LEAST_REST = 0.5
"""Least duration of a quality recording [s]; statistics of less mean little."""


def check_recording(
    place: Place,
    columns: Mapping[str, NDArray],
    role: str,
    ambient_bar: float,
    steps: Mapping[str, float],
    rules: RecordingRules = RULES,
) -> float:
    """Apply every rule to a recording's columns; returns the sampling period [s].

    Args:
        place: what messages call the recording and its samples.
        columns: by the file's column names, each (samples,) in the unit of the name.
        role: one of recording.ROLES.
        ambient_bar: p_env [bar absolute].
        steps: coarse steps of the campaign's readings by column [bar].
        rules: what the bench and its valve allow.

    Raises CampaignError at the first rule that is broken.
    """
    period = sampling_period(place.file, columns[TIME_COLUMN])
    sensors = {name: rules.sensors[c] for name, c in CHANNEL_OF.items() if name in columns}
    for name in sensors:
        # The supply may read the same in coarse steps, and any pressure of a steady record.
        may_rest = name in steps and (CHANNEL_OF[name] == "p1" or role == "quality")
        if name != "U_V" and not may_rest:  # a voltage may be fed back without noise
            values = columns[name]
            if np.min(values) == np.max(values):
                raise CampaignError(
                    f"{place.samples(0, len(values) - 1)}: {name} is {values[0]:g} throughout, and "
                    "noise moves every live channel: check its sensor, or give simulated data noise"
                )
    if role != "quality" and not switches(columns["U_V"]):
        U = columns["U_V"]
        _check_length(place, len(U), role, period)
        raise CampaignError(
            f"{place.samples(0, len(U) - 1)}: U_V never switches, it stays between {np.min(U):g} and "
            f"{np.max(U):g} V: record a switching of the coil, or give the recording the role quality"
        )
    check_units(place, columns, period, ambient_bar, rules)
    check_rate(place, period)
    _check_length(place, len(columns["U_V"]), role, period)
    for name, sensor in sensors.items():
        check_range(place, name, columns[name], sensor)
        if name != "U_V":
            check_clipped(place, name, columns[name], period)
    if role != "quality":
        _check_energised_start(place, columns["U_V"], period)
        for name, sensor in sensors.items():
            if name != "U_V":
                _check_steady_start(place, name, columns[name], sensor, period)
    return period


def _check_length(place: Place, samples: int, role: str, period: float) -> None:
    """A recording holds its steady start and more; one for statistics LEAST_REST."""
    needed = _samples(LEAST_REST, period) if role == "quality" else _samples(HOLD, period) + 1
    if samples < needed:
        raise CampaignError(
            f"{place.samples(samples - 1)}: the file ends after {samples} samples, and a {role} "
            f"recording at {1 / period:g} Hz needs at least {needed}: record for longer"
        )


def check_range(place: Place, name: str, values: NDArray, sensor: Sensor) -> None:
    """Values (samples,) lie in Table 1's range, but for the accuracy."""
    margin = sensor.margin + 1e-9
    outside = (values < sensor.low - margin) | (values > sensor.high + margin)
    if np.any(outside):
        sample = int(np.argmax(outside))
        raise CampaignError(
            f"{place.samples(sample)}: {name} is {values[sample]:g}, outside the sensor's "
            f"range [{sensor.low:g}, {sensor.high:g}] by more than its accuracy of "
            f"{sensor.margin:g}: check unit and scaling, or cut the recording there"
        )


def check_clipped(place: Place, name: str, values: NDArray, period: float) -> None:
    """No reading stays where a range ends, of the sensor or of what records it."""
    found = clipped(values, period)
    if found is not None:
        first, last = found
        end = "greatest" if values[first] == np.max(values) else "least"
        raise CampaignError(
            f"{place.samples(first, last)}: {name} stays at {values[first]:g}, its {end} reading, for "
            f"{1e3 * (last + 1 - first) * period:g} ms, and noise moves the others, so its range ends "
            "there: record again with a greater range, or leave the recording out"
        )


def _check_energised_start(place: Place, U: NDArray, period: float) -> None:
    """The coil is on for HOLD before it first switches."""
    off = np.flatnonzero(0.5 * np.max(U) >= U[: _samples(HOLD, period)])
    if off.size:
        raise CampaignError(
            f"{place.samples(int(off[0]))}: U_V is {U[off[0]]:g} V at {1e3 * off[0] * period:g} "
            f"ms, and recordings start energised for at least {1e3 * HOLD:g} ms: record from before "
            "the first switching"
        )


def _check_steady_start(place: Place, name: str, values: NDArray, sensor: Sensor, period: float) -> None:
    """Current and pressures rest during HOLD: first and last quarter agree within the accuracy."""
    start = values[: _samples(HOLD, period)]
    quarter = len(start) // 4
    change = float(np.mean(start[-quarter:]) - np.mean(start[:quarter]))
    if abs(change) > sensor.margin:
        raise CampaignError(
            f"{place.samples(0, len(start) - 1)}: {name} changes by {change:g} in the first "
            f"{1e3 * HOLD:g} ms, which must be steady: let the bench settle, energised, before "
            "recording"
        )


def _samples(duration: float, period: float) -> int:
    """Samples that a duration [s] holds."""
    return int(np.ceil(duration / period - 1e-6))
