"""The noise of each channel, and the steps in which readings come, as the readings show them.

A converter, a file's few digits or a vehicle's bus rounds readings. Where the step is coarse against the
sensor's noise, a live channel may read the same throughout, and rounding is the noise.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.channels import CHANNEL
from identification.noise import quantisation_step, rounding_error, white_noise
from identification.recordings.recording import (
    CHANNELS,
    PRESSURES,
    RULES,
    UNITS,
    Campaign,
    Recording,
    RecordingRules,
)

GRID_ERROR = 0.1
"""Distance from a grid, in its steps, within which a reading lies on it; digits are few."""
COARSE_STEP = 2.0
"""Step over Table 3's noise above which a live channel may read the same throughout: a sensor
that is somewhat quieter than Table 3's then rarely leaves a code."""

SWITCHING_TRANSIENT = 0.02
"""Time after a switching that the noise estimate leaves out [s]: the coil and p3 move."""


def noise_of(recordings: Sequence[Recording], channel: str) -> float:
    """Standard deviation of a channel's white noise about a smooth course, at least its rounding [SI].

    Readings in coarse steps hardly differ between neighbours, and err all the same.
    """
    series: list[NDArray] = []
    for recording in recordings:
        transient = round(SWITCHING_TRANSIENT / recording.period)
        switchings = np.flatnonzero(np.diff(recording.energised)) + 1
        first, *later = np.split(recording.channel(channel), switchings)
        series += [first, *(stretch[transient:] for stretch in later)]
    return max(white_noise(series), rounding_error(quantisation_step(series)))


def campaign_noise(campaign: Campaign) -> dict[str, float]:
    """`noise_of` each channel where the coil switches [SI], at least its sensor's rounding error."""
    recordings = [*campaign.with_role("calibration"), *campaign.with_role("validation")]
    finest = {name: campaign.rules.sensors[name].resolution * UNITS[name][1] for name in CHANNELS}
    least = {**finest, **campaign_steps(campaign.recordings, campaign.rules)}
    return {name: max(noise_of(recordings, name), rounding_error(least[name])) for name in CHANNELS}


@np.errstate(over="ignore", invalid="ignore")  # an absurd reading lies off the grid
def coarse_steps(pressures: Mapping[str, NDArray], sizes: Mapping[str, float]) -> dict[str, float]:
    """Steps of those pressures whose noise need not move the reading, by name [unit of the pressures].

    A pressure that takes few values only, such as a steady supply, has the coarsest step of the others.

    pressures: all readings of a campaign by name, each (samples,). sizes: the sensors' noise by name,
    in the same unit.
    """
    steps = {name: quantisation_step([readings]) for name, readings in pressures.items()}
    coarsest = max(steps.values(), default=0.0)
    for name, step in steps.items():
        if coarsest and not step:
            codes = np.unique(pressures[name]) / coarsest
            off_grid = np.abs(codes - codes[0] - np.rint(codes - codes[0]))
            steps[name] = coarsest if np.max(off_grid) < GRID_ERROR else 0.0
    return {name: step for name, step in steps.items() if step > COARSE_STEP * sizes[name]}


def column_steps(
    recordings: Sequence[Mapping[str, NDArray]], rules: RecordingRules = RULES
) -> dict[str, float]:
    """`coarse_steps` of a campaign's files by column [bar]; recordings: columns by name, (samples,)."""
    columns = {column: name for name in PRESSURES for column in CHANNEL[name].columns}
    readings = {
        column: np.concatenate([r[column] for r in recordings if column in r])
        for column in columns
        if any(column in r for r in recordings)
    }
    return coarse_steps(readings, {c: rules.sensors[columns[c]].noise for c in readings})


def campaign_steps(recordings: Sequence[Recording], rules: RecordingRules = RULES) -> dict[str, float]:
    """`coarse_steps` of recordings by channel [Pa]; empty on a bench of fine steps."""
    if not recordings:
        return {}
    pressures = {name: np.concatenate([r.channel(name) for r in recordings]) for name in PRESSURES}
    return coarse_steps(pressures, {n: rules.sensors[n].noise * UNITS[n][1] for n in PRESSURES})


def coarse_step_warnings(steps: Mapping[str, float]) -> list[str]:
    """What coarse steps, by channel [Pa], cost: a sentence, or none for fine readings."""
    if not steps:
        return []
    named = ", ".join(f"{name} {1e3 * step / UNITS[name][1]:.3g} mbar" for name, step in steps.items())
    return [
        f"pressures come in coarse steps ({named}): rounding counts as noise, a change below half a "
        "step does not show, and a steady pressure cannot be told from a dead sensor; record with finer "
        "steps where you can"
    ]
