"""Normal equations of a fit whose nuisances are eliminated: per run its own, then the shared ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FARTHEST = 3.0
"""Standard deviations by which a tolerance, or a run's own number, may differ from its centre."""


@dataclass(frozen=True, kw_only=True)
class Linear:
    """A hypothesis linearised in one run; everything in noise deviations, trusted samples or 0."""

    residual: NDArray
    """measured - model, (values,)."""
    slopes: NDArray
    """Derivatives of the model by the scaled vector, (values, k)."""
    local: NDArray
    """Derivatives by the run's own numbers, (values, l)."""
    local_value: NDArray
    """Their present values less their centres, (l,)."""
    local_sd: NDArray
    """Their standard deviations, (l,)."""
    shared: NDArray
    """Derivatives by the tolerances, each divided by its standard deviation, (values, m)."""


@dataclass(frozen=True, kw_only=True)
class Normal:
    """0.5 d' hessian d - gradient d + 0.5 chi_square over steps d of the vector."""

    hessian: NDArray
    gradient: NDArray
    chi_square: float
    shared: NDArray
    """Present estimate of the tolerances, in standard deviations, (m,)."""


def normal(runs: Sequence[Linear]) -> Normal:
    """Sum over runs; numbers that are no parameters are minimised over, with their priors."""
    k, m = runs[0].slopes.shape[1], runs[0].shared.shape[1]
    total = np.sum([_reduced(run) for run in runs], axis=0)
    # order: residual, slopes, shared
    shared = slice(1 + k, 1 + k + m)
    total[shared, shared] += np.eye(m)
    rest = np.r_[0 : 1 + k]
    solved = np.linalg.solve(total[shared, shared], total[shared, rest])
    reduced = total[np.ix_(rest, rest)] - total[rest, shared] @ solved
    return Normal(
        hessian=reduced[1:, 1:],
        gradient=reduced[1:, 0],
        chi_square=float(reduced[0, 0]),
        shared=_bounded(total[shared, shared], total[shared, 0], np.full(m, FARTHEST)),
    )


def _columns(run: Linear) -> NDArray:
    return np.column_stack([run.residual, run.slopes, run.shared])


def _reduced(run: Linear) -> NDArray:
    """Gram matrix of residual, slopes and shared after the run's own numbers are eliminated."""
    columns = _columns(run)
    gram = columns.T @ columns
    if not run.local.size:
        return gram
    precision = 1.0 / run.local_sd**2
    gram[0, 0] += float(np.sum(precision * run.local_value**2))
    cross = run.local.T @ columns
    cross[:, 0] -= precision * run.local_value
    own = run.local.T @ run.local + np.diag(precision)
    return gram - cross.T @ np.linalg.solve(own, cross)


def freed(run: Linear, shared: NDArray) -> tuple[NDArray, NDArray]:
    """Residual (values,) at given tolerances, less what the run's own explain; their step.

    What would need a number beyond FARTHEST is no nuisance and stays in the residual.
    """
    residual = run.residual - run.shared @ shared
    if not run.local.size:
        return residual, np.zeros(0)
    precision = 1.0 / run.local_sd**2
    own = run.local.T @ run.local + np.diag(precision)
    pull = run.local.T @ residual + (own - np.diag(precision)) @ run.local_value
    value = _bounded(own, pull, FARTHEST * run.local_sd)
    step = value - run.local_value
    return residual - run.local @ step, step


def _bounded(matrix: NDArray, right: NDArray, farthest: NDArray) -> NDArray:
    """Solution of matrix x = right whose numbers stay within +-farthest (active set)."""
    x = np.linalg.solve(matrix, right)
    bound = np.zeros(len(x), dtype=bool)
    while np.any(beyond := ~bound & (np.abs(x) > farthest)):
        bound |= beyond
        x = np.clip(x, -farthest, farthest)
        rest = right[~bound] - matrix[np.ix_(~bound, bound)] @ x[bound]
        x[~bound] = np.linalg.solve(matrix[np.ix_(~bound, ~bound)], rest)
    return x
