"""From which part of the recordings on a single cause acts, by linear prediction.

A cause changes the runs before its onset not at all, and those after it in proportion to its signature.
So one simulation of each cause serves every onset.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.variable_projection import LinearisedRun, eliminated, normal_equations
from identification.gap.search.screening import CauseSignature, with_changes


def least_squares_by_onset(
    runs: Sequence[LinearisedRun], signatures: Sequence[CauseSignature], parts: NDArray
) -> NDArray:
    """Sum of squares that the best single cause leaves if it acts from a part on, (parts,) [1].

    Args:
        runs: the model without a cause, linearised.
        signatures: of the causes beside it, in the same runs.
        parts: number of the part that each run belongs to, (runs,).
    """
    joint = [
        with_changes(run, [signature.changes[r] for signature in signatures])
        for r, run in enumerate(runs)
    ]
    grams = normal_equations(joint).runs.free()
    first = 1 + runs[0].slopes.shape[1]
    causes = np.arange(first, first + len(signatures))
    shares = np.array([signature.shares for signature in signatures])
    return np.array([_least(grams, causes, parts >= part, shares) for part in range(parts.max() + 1)])


def _least(grams: NDArray, causes: NDArray, acting: NDArray, shares: NDArray) -> float:
    """Sum of squares with the best cause in the runs `acting`, (runs,).

    grams: of residual, slopes, causes and shared nuisances, per run. causes: their places. shares: least
    and largest multiple of each signature.
    """
    gram, late = np.sum(grams, axis=0), np.sum(grams[acting], axis=0)
    gram[causes], gram[:, causes] = late[causes], late[:, causes]
    shared = np.arange(causes[-1] + 1, len(gram))
    gram[shared, shared] += 1.0
    others = np.concatenate([np.arange(1, causes[0]), shared])
    left = eliminated(gram, others, np.array([0, *causes]))
    curvature = np.maximum(np.diag(left)[1:], np.finfo(float).tiny)
    slope = left[0, 1:]
    share = np.clip(slope / curvature, *shares.T)
    return float(np.min(left[0, 0] - 2.0 * share * slope + share**2 * curvature))
