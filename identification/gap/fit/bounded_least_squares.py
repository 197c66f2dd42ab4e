"""Bounded least squares in normal equations."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear


def bounded_minimiser(matrix: NDArray, moment: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """Minimiser (n,) of 0.5 x' matrix x - moment x between low and high (bounded least squares)."""
    if not len(moment):
        return np.zeros(0)
    scale = 1.0 / np.sqrt(np.diag(matrix))
    try:
        root = np.linalg.cholesky(matrix * np.outer(scale, scale)).T
        free = scale * solve_triangular(root, solve_triangular(root.T, moment * scale, lower=True))
        if np.all((low <= free) & (free <= high)):
            return free
    except np.linalg.LinAlgError:  # columns that are equal but for rounding
        eigenvalues, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
        root = np.sqrt(np.maximum(eigenvalues, 1e-14))[:, None] * vectors.T
    target = np.linalg.solve(root.T, moment * scale)
    widest = np.maximum(high - low, np.finfo(float).tiny)
    solution = lsq_linear(root, target, (low / scale, (low + widest) / scale), method="bvls")
    return np.clip(solution.x * scale, low, high)
