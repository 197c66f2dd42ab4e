"""The floor of the gap: what noise alone leaves, from the differences of consecutive residuals.

A channel's noise comes from few readings at rest, where moreover a sensor may show more of it than at
the end of its range. An error of some percent would pass for a gap, or hide one. What is left of a
misfit hardly changes from one sample to the next; white noise does (Rice 1984). So the differences of
the finest model's residuals tell the noise of the very readings that are judged.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.grey_box import GreyBox

CLIP = 4.0
"""Standard deviations beyond which a difference is a misfit's jump, not noise."""

COLOURED = 0.1
"""Relative distance from the channel's noise from which on noise is not taken for white, where the
readings tell so small a distance (three standard deviations)."""


def differences(plant: GreyBox, residuals: Sequence[NDArray]) -> tuple[list[NDArray], list[NDArray]]:
    """Squared differences and where they count, per run (channels, samples), at the later sample."""
    changes = [np.diff(residual, axis=1, prepend=residual[:, :1]) for residual in residuals]
    pairs = [_pairs(run.trusted) for run in plant.runs]
    together = np.concatenate(changes, axis=1), np.concatenate(pairs, axis=1)
    limits = np.array([_limit(change[pair]) for change, pair in zip(*together, strict=True)])
    kept = [
        pair & (np.abs(change) <= limits[:, None]) for change, pair in zip(changes, pairs, strict=True)
    ]
    return [keep * change**2 for keep, change in zip(kept, changes, strict=True)], kept


def noise_draws(changes: NDArray, squares: NDArray) -> NDArray:
    """Noise deviation (draws, channels), relative to the channels', from means of squares.

    changes: of differences of the finest model's residuals; squares: of the residuals. The first row is
    the estimate. Where the noise is not white, it is the channel's, but no more than all that is left.
    """
    found = np.sqrt(changes / 2)
    white = np.abs(found[0] - 1) <= np.maximum(COLOURED, 3 * np.std(found, axis=0))
    return np.where(white, found, np.minimum(1.0, np.sqrt(squares)))


def _pairs(trusted: NDArray) -> NDArray:
    """Samples that count and follow one that does."""
    found = trusted.copy()
    found[:, 0] = False
    found[:, 1:] &= trusted[:, :-1]
    return found


def _limit(changes: NDArray) -> float:
    """CLIP standard deviations of what is not clipped."""
    limit = CLIP * 1.4826 * float(np.median(np.abs(changes))) if len(changes) else 0.0
    for _ in range(20):
        kept = changes[np.abs(changes) <= limit]
        if not len(kept):
            return np.inf
        limit = CLIP * float(np.sqrt(np.mean(kept**2)))
    return limit
