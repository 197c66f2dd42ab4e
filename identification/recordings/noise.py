"""The noise of each channel, and the steps in which readings come, as the readings show them.

A converter, a file's few digits or a vehicle's bus rounds readings. Where the step is coarse against the
sensor's noise, a live channel may read the same throughout, and rounding is the noise.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.channels import CHANNEL
from identification.recordings.recording import (
    CHANNELS,
    HOLD,
    PRESSURES,
    UNITS,
    Campaign,
    CampaignError,
    Recording,
)
from identification.recordings.rules import RULES, RecordingRules

DISTINCT_SHARE = 0.2
"""Distinct readings per sample above which the readings are taken for continuous (no grid)."""
LEAST_CODES = 10
"""Distinct readings that show a step; the least distance of a few may be several steps."""
GRID_ERROR = 0.1
"""Distance from a grid, in its steps, within which a reading lies on it; digits are few."""
COARSE_STEP = 2.0
"""Step over Table 3's noise above which a live channel may read the same throughout: a sensor
that is somewhat quieter than Table 3's then rarely leaves a code."""
NOISE_BLOCK = 0.05
"""Time over which a drift passes for straight when the noise is read [s]."""


def reading_step(readings: NDArray) -> float:
    """Step of the readings [their unit]: the least step between distinct readings, (samples,).

    The few digits of a file make equal steps unequal, so the step is the slope of the line through
    the distinct readings over their codes. 0.0: fewer than two distinct readings, or no grid.
    """
    distinct = np.unique(readings)
    if len(distinct) < 2 or len(distinct) > DISTINCT_SHARE * len(readings):
        return 0.0
    steps = np.diff(distinct)
    steps = steps[steps > 1e-3 * np.median(steps)]  # the same reading but for rounding in sums
    least = float(np.median(steps[steps < 1.5 * np.min(steps)]))
    return float(np.polyfit(np.rint((distinct - distinct[0]) / least), distinct, 1)[0])


def reliable_step(readings: NDArray) -> float:
    """`reading_step` of readings (samples,) [unit]; 0.0 where too few are distinct to trust it."""
    if len(np.unique(readings)) < LEAST_CODES:
        return 0.0
    return reading_step(readings)


def coarse_steps(
    pressures: Mapping[str, NDArray], sizes: Mapping[str, float], rules: RecordingRules = RULES
) -> dict[str, float]:
    """Steps of those pressures whose noise need not move the reading, by name [unit of the pressures].

    A pressure that takes few values only, such as a steady supply, has the coarsest step of the others.

    pressures: all readings of a campaign by name, each (samples,). sizes: the sensors' noise by name,
    in the same unit.
    """
    own = {name: reliable_step(readings) for name, readings in pressures.items()}
    coarsest = max(own.values(), default=0.0)
    steps = {name: step or _shared(pressures[name], coarsest) for name, step in own.items()}
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
    return coarse_steps(readings, {c: rules.sensors[columns[c]].noise for c in readings}, rules)


def campaign_steps(recordings: Iterable[Recording], rules: RecordingRules = RULES) -> dict[str, float]:
    """`coarse_steps` of recordings by channel [Pa]; empty on a bench of fine steps."""
    recordings = tuple(recordings)
    if not recordings:
        return {}
    pressures = {
        name: np.concatenate([recording.channel(name) for recording in recordings]) for name in PRESSURES
    }
    noise = {name: rules.sensors[name].noise * UNITS[name][1] for name in PRESSURES}
    return coarse_steps(pressures, noise, rules)


def rounding_error(step: float) -> float:
    """Standard deviation of the rounding to a step, in the step's unit."""
    return float(step / np.sqrt(12.0))


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


def _shared(readings: NDArray, coarsest: float) -> float:
    """The others' step, if the few distinct readings (samples,) lie on its grid; otherwise 0.0."""
    codes = np.unique(readings) / coarsest if coarsest else np.array([])
    off_grid = np.abs(codes - codes[:1] - np.rint(codes - codes[:1]))
    return coarsest if codes.size and np.max(off_grid) < GRID_ERROR else 0.0


def pooled_noise(campaign: Campaign) -> dict[str, float]:
    """Standard deviation of each channel's readings about the true value [A, V, Pa], pooled.

    From the quality recordings if there are any, otherwise from the holds that the other recordings
    start with. Raises CampaignError if a hold is too short.
    """
    steady = campaign.with_role("quality")
    stretches = [(r, len(r)) for r in steady] or [
        (r, energised_start_length(r)) for r in campaign.recordings
    ]
    return _pooled(campaign.recordings, stretches, campaign.rules)


def energised_start_length(recording: Recording) -> int:
    """Length of the energised start [samples]. Raises CampaignError if it lasts less than HOLD."""
    energised = recording.energised
    samples = len(recording) if np.all(energised) else int(np.argmin(energised))
    if samples * recording.period < HOLD * (1 - 1e-9):
        raise CampaignError(
            f"{recording.name}: energised for the first {1e3 * samples * recording.period:.3g} ms only; "
            f"the noise is read off {1e3 * HOLD:.0f} ms or more: start recordings in steady state"
        )
    return samples


def _pooled(
    recordings: Sequence[Recording], stretches: Sequence[tuple[Recording, int]], rules: RecordingRules
) -> dict[str, float]:
    """The noise by channel [SI] in stretches, at least the error by which the recordings are rounded."""
    coarse = campaign_steps(recordings, rules)
    finest = {name: rules.sensors[name].resolution * UNITS[name][1] for name in CHANNELS}
    least = {**finest, **coarse}
    return {
        name: max(_deviation(name, stretches, NOISE_BLOCK), rounding_error(least[name]))
        for name in CHANNELS
    }


def _deviation(name: str, stretches: Sequence[tuple[Recording, int]], block: float) -> float:
    """Root of the summed squares over the summed degrees of freedom [SI]."""
    parts = [
        _about_lines(recording.channel(name)[:samples], recording.period, block)
        for recording, samples in stretches
    ]
    variance = sum(squares for squares, _ in parts) / sum(degrees for _, degrees in parts)
    return float(np.sqrt(variance))


def _about_lines(signal: NDArray, period: float, block: float) -> tuple[float, int]:
    """Sum of squares and degrees of freedom about one straight line per block, (samples,)."""
    blocks = np.array_split(signal, max(1, int(len(signal) * period / block)))
    return sum(_squares(part) for part in blocks), len(signal) - 2 * len(blocks)


def _squares(block: NDArray) -> float:
    time = np.arange(len(block)) - (len(block) - 1) / 2
    slope = time @ block / (time @ time)
    return float(np.sum((block - np.mean(block) - slope * time) ** 2))
