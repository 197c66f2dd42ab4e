"""The noise of each channel, read off a steady record or off the hold before a test."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.recordings.reading_steps import campaign_steps, rounding_error
from identification.recordings.recording import CHANNELS, HOLD, UNITS, Campaign, CampaignError, Recording
from identification.recordings.rules import RULES, RecordingRules


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


def noise_of_energised_start(recording: Recording, rules: RecordingRules = RULES) -> dict[str, float]:
    """As `pooled_noise`, from the energised steady start of one recording [A, V, Pa]."""
    stretch = (recording, energised_start_length(recording))
    return _pooled([recording], [stretch], rules)


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
        name: max(_deviation(name, stretches, rules.noise_block), rounding_error(least[name]))
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
