"""Normal equations of a fit whose nuisances are eliminated: per run its own, then the shared ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

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
    """Least squares in steps d of the vector and tolerances x; the runs' own numbers are minimised over.

    For Gaussian tolerances: 0.5 d' hessian d - gradient d + 0.5 least over d.
    """

    gram: NDArray
    """Of the residual, slopes and shared, with the priors of the last, (1 + k + m, 1 + k + m)."""
    hessian: NDArray
    gradient: NDArray
    least: float
    """Sum of squares at no step, with tolerances of any size."""
    chi_square: float
    """The same with tolerances within FARTHEST."""
    shared: NDArray
    """These tolerances, in standard deviations, (m,)."""

    def step(self, low: NDArray, high: NDArray, damping: float) -> tuple[NDArray, float]:
        """Best step between low and high (k,) with tolerances within FARTHEST, and what it gains.

        damping: of Levenberg and Marquardt, relative to the diagonal.
        """
        k, m = len(low), len(self.shared)
        matrix = self.gram[1:, 1:].copy()
        damped = np.arange(k)
        matrix[damped, damped] *= 1.0 + damping
        matrix[damped, damped] += 1e-9
        farthest = np.full(m, FARTHEST)
        ends = np.concatenate([low, -farthest]), np.concatenate([high, farthest])
        best = _within(matrix, self.gram[1:, 0], *ends)
        left = _left(self.gram, best)
        return best[:k], self.chi_square - left


def normal(runs: Sequence[Linear]) -> Normal:
    """Sum over runs; numbers that are no parameters are minimised over, with their priors."""
    k, m = runs[0].slopes.shape[1], runs[0].shared.shape[1]
    gram = np.sum([_reduced(run) for run in runs], axis=0)
    # order: residual, slopes, shared
    shared = np.arange(1 + k, 1 + k + m)
    gram[shared, shared] += 1.0
    free = _eliminated(gram, shared, np.arange(1 + k))
    farthest = np.full(m, FARTHEST)
    own = gram[np.ix_(shared, shared)]
    x = _within(own, gram[shared, 0], -farthest, farthest)
    return Normal(
        gram=gram,
        hessian=free[1:, 1:],
        gradient=free[1:, 0],
        least=float(free[0, 0]),
        chi_square=_left(gram, np.concatenate([np.zeros(k), x])),
        shared=x,
    )


def _left(gram: NDArray, numbers: NDArray) -> float:
    """Sum of squares after the numbers have taken their share of the residual in row 0."""
    return float(gram[0, 0] - 2 * numbers @ gram[1:, 0] + numbers @ gram[1:, 1:] @ numbers)


def _within(matrix: NDArray, right: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """Minimiser of 0.5 x' matrix x - right x between low and high (bounded least squares)."""
    if not len(right):
        return np.zeros(0)
    scale = 1.0 / np.sqrt(np.diag(matrix))
    try:
        root = np.linalg.cholesky(matrix * np.outer(scale, scale)).T
    except np.linalg.LinAlgError:  # slopes that are the same but for rounding
        eigenvalues, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
        root = np.sqrt(np.maximum(eigenvalues, 1e-14))[:, None] * vectors.T
    aim = np.linalg.solve(root.T, right * scale)
    widest = np.maximum(high - low, np.finfo(float).tiny)
    found = lsq_linear(root, aim, (low / scale, (low + widest) / scale), method="bvls")
    return np.clip(found.x * scale, low, high)


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
    own = run.local.T @ run.local
    pull = run.local.T @ residual + own @ run.local_value
    farthest = FARTHEST * run.local_sd
    value = _within(own + np.diag(1.0 / run.local_sd**2), pull, -farthest, farthest)
    step = value - run.local_value
    return residual - run.local @ step, step
