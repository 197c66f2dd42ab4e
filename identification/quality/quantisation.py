"""Readings that stop moving: how long one lasts, and how long chance allows."""

import numpy as np
from numpy.typing import NDArray
from scipy import stats


def longest_run(readings: NDArray) -> int:
    """Length of the longest run of one and the same reading [samples]; readings: (samples,)."""
    changes = np.flatnonzero(np.diff(readings) != 0)
    return int(np.max(np.diff(np.concatenate(([-1], changes, [len(readings) - 1])))))


def run_limit(readings: NDArray, *, rounding: float, significance: float) -> int:
    """Length that runs of independent readings, (samples,), reach with a small probability [samples].

    A run of L readings starts at one of n samples with probability p^L, so the limit solves
    n p^L = significance, a probability. p is the share of the commonest reading, or what normal noise
    about that reading gives it if that is more, as under a drift. rounding: step over sigma. The limit
    is n for readings that never change, and at most n.
    """
    samples = len(readings)
    share = np.max(np.unique(readings, return_counts=True)[1]) / samples
    share = max(share, 1 - 2 * stats.norm.sf(rounding / 2))
    if share == 1.0:
        return samples
    return min(samples, int(np.ceil(np.log(significance / samples) / np.log(share))))
