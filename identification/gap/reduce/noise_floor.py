"""Noise floor: what noise alone leaves of the gap, from differences of consecutive residuals.

The noise of a channel is estimated from few readings at rest, where a sensor may also be noisier than at
the end of its range. An error of some percent would look like a gap, or hide one. A misfit hardly
changes from one sample to the next; white noise does (Rice 1984). So the differences of the best model's
residuals give the noise of the very readings that are judged.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.grey_box import GreyBox
from identification.gap.reduce.settings import ReductionSettings

MEDIAN_TO_SD = 1.4826
"""Standard deviation of a normal distribution over the median of its absolute values."""


def squared_differences(
    plant: GreyBox, residuals: Sequence[NDArray], settings: ReductionSettings
) -> tuple[list[NDArray], list[NDArray]]:
    """Squared differences of consecutive residuals, and where they count, at the later sample.

    Args:
        plant: the plant with its recordings.
        residuals: per run (channels, samples) [noise deviations].
        settings: limit of jumps.

    Returns:
        Squares [noise variances] and boolean masks, per run (channels, samples) each.
    """
    changes = [np.diff(residual, axis=1, prepend=residual[:, :1]) for residual in residuals]
    pairs = [_trusted_pairs(run.trusted) for run in plant.runs]
    together = np.concatenate(changes, axis=1), np.concatenate(pairs, axis=1)
    limits = np.array(
        [_jump_limit(change[pair], settings) for change, pair in zip(*together, strict=True)]
    )
    kept = [
        pair & (np.abs(change) <= limits[:, None]) for change, pair in zip(changes, pairs, strict=True)
    ]
    return [keep * change**2 for keep, change in zip(kept, changes, strict=True)], kept


def noise_ratios(changes: NDArray, squares: NDArray, settings: ReductionSettings) -> NDArray:
    """Noise standard deviation relative to the channel's, (draws, channels) [1]; row 0 is the estimate.

    Where the noise is not white, the ratio is 1, but no more than all that is left.

    Args:
        changes: mean squared differences of the best model's residuals, (draws, channels) [noise
            variances].
        squares: mean squares of these residuals, (draws, channels) [noise variances].
        settings: when noise is white.
    """
    ratios = np.sqrt(changes / 2)
    allowed = np.maximum(
        settings.white_noise_tolerance, settings.white_noise_deviations * np.std(ratios, axis=0)
    )
    white = np.abs(ratios[0] - 1) <= allowed
    return np.where(white, ratios, np.minimum(1.0, np.sqrt(squares)))


def _trusted_pairs(trusted: NDArray) -> NDArray:
    """Trusted samples that follow a trusted one, boolean (channels, samples)."""
    pairs = trusted.copy()
    pairs[:, 0] = False
    pairs[:, 1:] &= trusted[:, :-1]
    return pairs


def _jump_limit(changes: NDArray, settings: ReductionSettings) -> float:
    """Largest difference that is no jump, from the standard deviation of those below the limit.

    changes: (differences,) [noise deviations].
    """
    median = float(np.median(np.abs(changes))) if len(changes) else 0.0
    limit = settings.jump_limit * MEDIAN_TO_SD * median
    for _ in range(settings.jump_iterations):
        kept = changes[np.abs(changes) <= limit]
        if not len(kept):
            return np.inf
        limit = settings.jump_limit * float(np.sqrt(np.mean(kept**2)))
    return limit
