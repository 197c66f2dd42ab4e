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
    """Estimate of the tolerances at no step, in standard deviations, (m,)."""


def normal(runs: Sequence[Linear]) -> Normal:
    """Sum over runs; numbers that are no parameters are minimised over, with their priors.

    A tolerance that would go beyond FARTHEST is held there. The runs' own are not, as their bounds
    (`freed`) would hold the parameters back from far away.
    """
    k, m = runs[0].slopes.shape[1], runs[0].shared.shape[1]
    total = np.sum([_reduced(run) for run in runs], axis=0)
    # order: residual, slopes, shared
    shared = np.arange(1 + k, 1 + k + m)
    total[shared, shared] += 1.0
    farthest = np.full(m, FARTHEST)
    now = _bounded(total[np.ix_(shared, shared)], total[shared, 0], farthest)
    # Which are held is judged where the step leads: else parameters would creep along with them.
    slopes = np.arange(1, 1 + k)
    ahead = total.copy()
    ahead[slopes, slopes] += 1e-9
    ahead = _eliminated(ahead, slopes, np.append(0, shared))
    then = _bounded(ahead[1:, 1:], ahead[1:, 0], farthest)
    held = np.abs(then) >= FARTHEST
    reduced = _eliminated(_moved(total, shared[held], then[held]), shared[~held], np.arange(1 + k))
    return Normal(
        hessian=reduced[1:, 1:],
        gradient=reduced[1:, 0],
        chi_square=float(_moved(total, shared, now)[0, 0]),
        shared=now,
    )


def _moved(gram: NDArray, which: NDArray, by: NDArray) -> NDArray:
    """Gram matrix whose residual, in row 0, has these columns times `by` taken away."""
    moved = gram.copy()
    moved[0] -= by @ gram[which]
    moved[:, 0] -= moved[:, which] @ by
    return moved


def _eliminated(gram: NDArray, which: NDArray, kept: NDArray) -> NDArray:
    """Gram matrix of the kept columns after minimising over the others (Schur complement)."""
    cross = gram[np.ix_(which, kept)]
    return gram[np.ix_(kept, kept)] - cross.T @ np.linalg.solve(gram[np.ix_(which, which)], cross)


def _reduced(run: Linear) -> NDArray:
    """Gram matrix of residual, slopes and shared after the run's own numbers are minimised over."""
    columns = np.column_stack([run.residual, run.slopes, run.shared, run.local])
    gram = columns.T @ columns
    count, own = len(gram) - len(run.local_sd), len(run.local_sd)
    if not own:
        return gram
    local = np.arange(count, count + own)
    # The numbers themselves, from their centres, stand in the place of steps from where they are.
    gram = _moved(gram, local, -run.local_value)
    gram[local, local] += 1.0 / run.local_sd**2
    return _eliminated(gram, local, np.arange(count))


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
