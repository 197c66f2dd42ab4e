"""How many sub-steps a sampling period needs."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.ode.settings import OdeSettings


def settled_steps(read: Callable[[int], Sequence[NDArray]], settings: OdeSettings) -> int:
    """Sub-steps whose halving changes no reading noticeably, or the most that are tried.

    read: readings with so many sub-steps, per run (channels, samples, n) [noise deviations].
    """
    steps, coarse = 1, read(1)
    while 2 * steps <= settings.most_steps_per_sample:
        fine = read(2 * steps)
        if _largest_change(coarse, fine) <= settings.step_error:
            return steps
        steps, coarse = 2 * steps, fine
    return steps


def _largest_change(coarse: Sequence[NDArray], fine: Sequence[NDArray]) -> float:
    """Largest difference of readings [noise deviations]; infinity where only the fine one is finite."""
    changes = [
        np.where(np.isfinite(b), np.nan_to_num(np.abs(b - a), nan=np.inf), 0.0)
        for a, b in zip(coarse, fine, strict=True)
    ]
    return float(max(np.max(change) for change in changes))
