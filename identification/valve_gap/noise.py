"""The sensors' noise, from how readings change between neighbours where the valve does little.

The hold before the first switching, from which calibration takes it, has a few dozen samples: its
standard deviation is known to some percent only, and a gap is judged by less.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.recordings.noise import reliable_step, rounding_error
from identification.recordings.recording import Recording
from identification.valve_gap.settings import VALVE, ValveSettings


def noise_of(recordings: Sequence[Recording], channel: str, settings: ValveSettings = VALVE) -> float:
    """Standard deviation of a channel's readings about a smooth course [SI].

    Half the variance of first differences (Rice 1984), which a slope does not enter; the median over
    blocks, which a few lively ones do not move, made the mean of a chi-square variable. A slow ripple
    hardly enters: what neighbours share is no noise. Readings in coarse steps hardly differ between
    neighbours, so their rounding error is the least.
    """
    estimates = [_block_variances(recording, channel, settings) for recording in recordings]
    variances = np.concatenate([part for part, _ in estimates])
    length = min(length for _, length in estimates)
    freedom = 2.0 * length / 3.0  # differences of white noise are correlated by -1/2
    found = float(np.sqrt(np.median(variances) / (1.0 - 2.0 / (9.0 * freedom)) ** 3))
    step = reliable_step(np.concatenate([recording.channel(channel) for recording in recordings]))
    return max(found, rounding_error(step))


def _block_variances(recording: Recording, channel: str, settings: ValveSettings) -> tuple[NDArray, int]:
    """Variance of the noise in each quiet block, and the block's length [samples]."""
    changes = np.diff(recording.channel(channel))
    length = min(max(4, round(settings.noise_block / recording.period)), len(changes))
    transient = round(settings.switching_transient / recording.period)
    lively = np.zeros(len(changes), dtype=bool)
    for switching in np.flatnonzero(np.diff(recording.energised)):
        lively[switching : switching + transient] = True
    count = len(changes) // length
    blocks = changes[: count * length].reshape(count, length)
    quiet = ~np.any(lively[: count * length].reshape(count, length), axis=1)
    return 0.5 * np.var(blocks[quiet if np.any(quiet) else slice(None)], axis=1), length
