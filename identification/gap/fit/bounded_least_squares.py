"""Bounded least squares in normal equations."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

PIVOTS = 10
"""Most exchanges of the numbers at their bounds; few problems need more than five, and another method
solves those."""

ROUNDING = 1e-10
"""Relative excess of a bound, and slope at a bound, that is rounding."""


def bounded_minimiser(matrix: NDArray, moment: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """Minimiser (n,) of 0.5 x' matrix x - moment x between low and high (bounded least squares).

    By block pivoting (Portugal, Judice and Vicente 1994), which needs a definite matrix and may run in a
    circle; else by the slower method of Stark and Parker (1995).
    """
    if not len(moment):
        return np.zeros(0)
    scale = 1.0 / np.sqrt(np.diag(matrix))
    scaled, target = matrix * np.outer(scale, scale), moment * scale
    try:
        found = _pivoted(scaled, target, low / scale, high / scale)
    except np.linalg.LinAlgError:  # columns that are equal but for rounding
        found = None
    if found is None:
        found = _by_factors(scaled, target, low / scale, high / scale)
    return np.clip(found * scale, low, high)


def _pivoted(matrix: NDArray, moment: NDArray, low: NDArray, high: NDArray) -> NDArray | None:
    """The minimiser (n,): numbers beyond a bound go there, those that push inwards leave it.

    None where this does not end.
    """
    fixed = high <= low
    below, above = fixed.copy(), np.zeros(len(moment), dtype=bool)
    for _ in range(PIVOTS):
        free = ~(below | above)
        x = np.where(below, low, np.where(above, high, 0.0))
        if np.any(free):
            own = matrix[np.ix_(free, free)]
            x[free] = np.linalg.solve(own, moment[free] - matrix[free] @ x)
        slope = matrix @ x - moment
        tolerance = ROUNDING * (1.0 + np.abs(x))
        leaves = ~fixed & ((below & (slope < -ROUNDING)) | (above & (slope > ROUNDING)))
        too_low, too_high = free & (x < low - tolerance), free & (x > high + tolerance)
        if not np.any(leaves | too_low | too_high):
            return x
        below, above = (below & ~leaves) | too_low, (above & ~leaves) | too_high
    return None


def _by_factors(matrix: NDArray, moment: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """The minimiser (n,) by bounded-variable least squares in a factor of the matrix."""
    eigenvalues, vectors = np.linalg.eigh(matrix)
    root = np.sqrt(np.maximum(eigenvalues, 1e-14))[:, None] * vectors.T
    target = np.linalg.solve(root.T, moment)
    widest = np.maximum(high - low, np.finfo(float).tiny)
    return lsq_linear(root, target, (low, low + widest), method="bvls").x
