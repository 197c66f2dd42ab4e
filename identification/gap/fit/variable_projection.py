"""Variable projection: nuisance parameters are minimised over, each run's own first, then shared ones.

The residuals are linear in the nuisance parameters, whose Gaussian priors add rows to the least-squares
problem. Eliminating them from the normal equations leaves equations in the parameters of interest alone
(Golub and Pereyra 1973; Schur complement).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

RIDGE = 1e-9
"""Added to a Hessian's diagonal, as no reading may tell of a parameter, or two may act alike [1]."""

ROUNDING = 1e-10
"""Relative excess of a bound, and slope at a bound, that is rounding [1]."""


def bounded_minimiser(matrix: NDArray, moment: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """Minimiser (n,) of 0.5 x' matrix x - moment x between low and high (bounded least squares).

    By block pivoting (Portugal, Judice and Vicente 1994; Kim and Park 2011).
    """
    if not len(moment):
        return np.zeros(0)
    scale = 1.0 / np.sqrt(np.diag(matrix))
    scaled = matrix * np.outer(scale, scale) + RIDGE * np.eye(len(scale))
    return np.clip(_pivoted(scaled, moment * scale, low / scale, high / scale) * scale, low, high)


def _pivoted(matrix: NDArray, moment: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """The minimiser (n,): numbers beyond a bound go there, those that push inwards leave it.

    Where exchanging all of them together has not helped three times, the last one alone is exchanged,
    which ends; few problems need more than five exchanges.
    """
    place = np.where(high <= low, -1, 0)  # -1: at the lower bound, 1: at the upper one, 0: between
    x, fewest, tries = np.zeros(len(moment)), len(moment) + 1, 3
    for _ in range(100):
        free = np.flatnonzero(place == 0)
        x = np.where(place < 0, low, np.where(place > 0, high, 0.0))
        if len(free):
            own = matrix[free]
            x[free] = np.linalg.solve(own[:, free], moment[free] - own @ x)
        target = _wanted(matrix, moment, low, high, place, x)
        wrong = np.flatnonzero(target != place)
        if not len(wrong):
            break
        tries = 3 if len(wrong) < fewest else tries - 1
        fewest = min(fewest, len(wrong))
        if tries < 0:
            wrong = wrong[-1:]
        place[wrong] = target[wrong]
    return x


def _wanted(
    matrix: NDArray, moment: NDArray, low: NDArray, high: NDArray, place: NDArray, x: NDArray
) -> NDArray:
    """Where each number wants to be: -1 at its lower bound, 1 at the upper one, 0 between, (n,)."""
    tolerance = ROUNDING * (1.0 + np.abs(x))
    beyond = 1 * (x > high + tolerance) - 1 * (x < low - tolerance)
    kept = np.where(place * (matrix @ x - moment) > ROUNDING, 0, place)
    return np.where(high <= low, place, np.where(place == 0, beyond, kept))


LARGEST_DEVIATION = 3.0
"""Bound of a nuisance parameter [standard deviations from its centre]: a larger deviation is not a
nuisance and stays in the residual."""

ACTIVE_SET_ITERATIONS = 12
"""Most changes of the set of nuisances at their bounds. In the second half none leaves the set again, so
that sets do not follow each other in a circle."""


@dataclass(frozen=True, kw_only=True)
class LinearisedRun:
    """A hypothesis linearised in one run; values are weighted readings, 0 where they do not count.

    k parameters, l nuisance parameters of the run, m shared ones: tolerances.
    """

    residual: NDArray
    """measured - model, (values,) [noise deviations]."""
    slopes: NDArray
    """Derivatives of the model by the scaled vector, (values, k) [noise deviations]."""
    slope_precision: NDArray
    """Precision of the vector's Gaussian priors, the same in every run, (k,) [1]."""
    slope_values: NDArray
    """The vector less their means, (k,) [1]."""
    run_slopes: NDArray
    """Derivatives by the run's nuisance parameters: run parameters of causes, then run offsets,
    (values, l) [noise deviations/SI]."""
    run_values: NDArray
    """Present values of these, less their centres, (l,) [SI]."""
    run_sd: NDArray
    """Standard deviations of these, (l,) [SI]."""
    shared_slopes: NDArray
    """Derivatives by the shared nuisances, (values, m) [noise deviations/standard deviation]."""


@dataclass(frozen=True, kw_only=True)
class RunProducts:
    """Products of the columns of each run: residual, slopes, shared slopes, run nuisances."""

    grams: NDArray
    """Gram matrices with the priors of the run nuisances, which count from their centres,
    (runs, 1 + k + m + l, 1 + k + m + l) [1]."""
    bounds: NDArray
    """Bounds of the run nuisances, (runs, l) [SI]."""
    prior: NDArray
    """What the priors of slopes and shared nuisances add to the sum of all runs' Gram matrices,
    (1 + k + m, 1 + k + m) [1]."""

    @property
    def count(self) -> int:
        """Number 1 + k + m of columns before those of the run nuisances."""
        return self.grams.shape[1] - self.bounds.shape[1]

    def held(self, numbers: NDArray) -> NDArray:
        """Values of the run nuisances that end at a bound (runs, l) [SI]; NaN for those between.

        numbers: of slopes and shared nuisances, (k + m,) [1].
        """
        rows = self.grams[:, self.count :]
        own, moment = rows[:, :, self.count :], rows[:, :, 0] - rows[:, :, 1 : self.count] @ numbers
        value = np.linalg.solve(own, moment[..., None])[..., 0]
        for r in np.flatnonzero(np.any(np.abs(value) > self.bounds, axis=1)):
            value[r] = bounded_minimiser(own[r], moment[r], -self.bounds[r], self.bounds[r])
        ended = np.abs(value) >= (1.0 - ROUNDING) * self.bounds
        return np.where(ended, np.sign(value) * self.bounds, np.nan)

    def reduced(self, held: NDArray) -> NDArray:
        """Gram matrices of the other columns, (runs, 1 + k + m, 1 + k + m) [1].

        held: values of run nuisances that stay there, (runs, l) [SI]; NaN: minimised over.
        """
        free = np.isnan(held)
        gram = _shifted(self.grams, self.count, np.where(free, 0.0, held))
        cross = gram[:, self.count :, : self.count] * free[..., None]
        own = gram[:, self.count :, self.count :] * (free[..., None] & free[:, None])
        own = own + np.eye(free.shape[1]) * ~free[:, None]
        rest = gram[:, : self.count, : self.count]
        return rest - cross.transpose(0, 2, 1) @ np.linalg.solve(own, cross)

    def free(self) -> NDArray:
        """`reduced` with all run nuisances minimised over, (runs, 1 + k + m, 1 + k + m) [1]."""
        return self.reduced(np.full(self.bounds.shape, np.nan))

    def of(self, kept: NDArray) -> "RunProducts":
        """The products of some of the columns before those of the run nuisances; kept: their places."""
        every = np.concatenate([kept, np.arange(self.count, self.grams.shape[1])])
        return replace(
            self, grams=self.grams[:, every][:, :, every], prior=self.prior[np.ix_(kept, kept)]
        )

    def together(self, reduced: NDArray) -> NDArray:
        """Gram matrix of residual, slopes and shared slopes of all runs, with the priors of the latter.

        reduced: of each run, (runs, 1 + k + m, 1 + k + m) [1].
        """
        return np.sum(reduced, axis=0) + self.prior


@dataclass(frozen=True, kw_only=True)
class NormalEquations:
    """Least squares in steps d of the vector; nuisance parameters are minimised over.

    For unbounded nuisances the sum of squares is d' hessian d - 2 gradient d + least.
    """

    runs: RunProducts
    steps: int
    """Number k of parameters."""
    hessian: NDArray
    """Gauss-Newton Hessian of half the sum of squares, (k, k) [1]."""
    gradient: NDArray
    """Its negative gradient at no step, (k,) [1]."""
    least: float
    """Sum of squares at no step, with unbounded nuisances [1]."""
    chi_square: float
    """Sum of squares at no step, with bounded nuisances [1]."""
    shared: NDArray
    """The shared nuisances that minimise `chi_square`, (m,) [standard deviations]."""

    def step(self, low: NDArray, high: NDArray, damping: float) -> tuple[NDArray, float]:
        """Best bounded step and the decrease of chi-square that it promises.

        Args:
            low: lower bounds of the step, (k,) [1].
            high: upper bounds of the step, (k,) [1].
            damping: of Levenberg and Marquardt, relative to the diagonal [1].

        Returns:
            The step (k,) [1], with nuisances within their bounds, and the predicted decrease [1].
        """
        m = len(self.shared)
        bound = np.full(m, LARGEST_DEVIATION)
        ends = np.concatenate([low, -bound]), np.concatenate([high, bound])
        best, squares = _bounded_solution(self.runs, self.steps, ends, damping)
        return best[: self.steps], self.chi_square - squares


def normal_equations(runs: Sequence[LinearisedRun]) -> NormalEquations:
    """Normal equations of several runs together: the same hypothesis linearised in each of them."""
    return equations_of(products_of(runs), runs[0].slopes.shape[1])


def products_of(runs: Sequence[LinearisedRun]) -> RunProducts:
    """Products of the columns of runs, the same hypothesis linearised in each of them."""
    columns = [_columns(run) for run in runs]
    return _with_priors(np.array([own.T @ own for own in columns]), runs)


def equations_of(products: RunProducts, k: int) -> NormalEquations:
    """Normal equations in k slopes from the products of several runs."""
    m = products.count - 1 - k
    gram = products.together(products.free())
    free = eliminated(gram, np.arange(1 + k, 1 + k + m), np.arange(1 + k))
    none, bound = np.zeros(k), np.full(m, LARGEST_DEVIATION)
    ends = np.concatenate([none, -bound]), np.concatenate([none, bound])
    best, chi_square = _bounded_solution(products, k, ends, 0.0)
    return NormalEquations(
        runs=products,
        steps=k,
        hessian=free[1:, 1:],
        gradient=free[1:, 0],
        least=float(free[0, 0]),
        chi_square=chi_square,
        shared=best[k:],
    )


def _bounded_solution(
    runs: RunProducts, k: int, ends: tuple[NDArray, NDArray], damping: float
) -> tuple[NDArray, float]:
    """Numbers (k + m,) within their ends that minimise the sum of squares, and that sum [1].

    Run nuisances beyond their bounds are held there, and the rest is solved again (active sets).
    """
    held = np.full(runs.bounds.shape, np.nan)
    free = ends[1] > ends[0]
    best, gram = np.zeros(len(free)), np.zeros((1 + len(free), 1 + len(free)))
    for iteration in range(ACTIVE_SET_ITERATIONS):
        gram = runs.together(runs.reduced(held))
        matrix = gram[1:, 1:].copy()
        damped = np.arange(k)
        matrix[damped, damped] *= 1.0 + damping
        matrix[damped, damped] += RIDGE
        own = np.ix_(free, free)
        best[free] = bounded_minimiser(matrix[own], gram[1:, 0][free], ends[0][free], ends[1][free])
        beyond = runs.held(best)
        if iteration >= ACTIVE_SET_ITERATIONS // 2:
            beyond = np.where(np.isfinite(held), held, beyond)
        if np.array_equal(held, beyond, equal_nan=True):
            break
        held = beyond
    return best, float(gram[0, 0] - 2 * best @ gram[1:, 0] + best @ gram[1:, 1:] @ best)


def without_run_nuisances(run: LinearisedRun, shared: NDArray) -> tuple[NDArray, NDArray]:
    """Residual of a run less what its nuisance parameters explain, and the step to their best values.

    A deviation beyond the bound is no nuisance: it stays in the residual.

    Args:
        run: the linearised run.
        shared: given shared nuisances, (m,) [standard deviations].

    Returns:
        Residual (values,) [noise deviations] and step of the nuisance parameters (l,) [SI].
    """
    residual = run.residual - run.shared_slopes @ shared
    if not run.run_slopes.size:
        return residual, np.zeros(0)
    gram = run.run_slopes.T @ run.run_slopes
    moment = run.run_slopes.T @ residual + gram @ run.run_values
    bound = LARGEST_DEVIATION * run.run_sd
    value = bounded_minimiser(gram + np.diag(1.0 / run.run_sd**2), moment, -bound, bound)
    step = value - run.run_values
    return residual - run.run_slopes @ step, step


def _shifted(grams: NDArray, first: int, amounts: NDArray) -> NDArray:
    """Gram matrices after the columns from `first` on times `amounts` leave the residual in row 0.

    grams: (runs, columns, columns). amounts: (runs, l).
    """
    shifted = grams.copy()
    shifted[:, 0] -= (amounts[:, None] @ grams[:, first:])[:, 0]
    shifted[:, :, 0] -= (shifted[:, :, first:] @ amounts[..., None])[..., 0]
    return shifted


def eliminated(gram: NDArray, columns: NDArray, kept: NDArray) -> NDArray:
    """Gram matrix (kept, kept) of columns after minimising over the others (Schur complement)."""
    cross = gram[np.ix_(columns, kept)]
    own = gram[np.ix_(columns, columns)]
    return gram[np.ix_(kept, kept)] - cross.T @ np.linalg.solve(own, cross)


def _columns(run: LinearisedRun) -> NDArray:
    """Residual, slopes, shared slopes and slopes of run nuisances (values, 1 + k + m + l)."""
    return np.column_stack([run.residual, run.slopes, run.shared_slopes, run.run_slopes])


def _with_priors(grams: NDArray, runs: Sequence[LinearisedRun]) -> RunProducts:
    """Products of each run's columns, those of the run nuisances last, with these nuisances' priors."""
    sd, values = (np.array([getattr(run, name) for run in runs]) for name in ("run_sd", "run_values"))
    first = grams.shape[1] - sd.shape[1]
    # Unknowns become the nuisances' distances from their centres, not steps from present values.
    grams = _shifted(grams, first, -values)
    nuisances = np.arange(first, grams.shape[1])
    grams[:, nuisances, nuisances] += 1.0 / sd**2
    # Of residual, slopes, slopes that were added to them, and shared nuisances.
    prior, run = np.zeros((first, first)), runs[0]
    slopes = np.arange(1, 1 + len(run.slope_precision))
    shared = np.arange(first - run.shared_slopes.shape[1], first)
    moment = run.slope_precision * run.slope_values
    prior[0, 0] = moment @ run.slope_values
    prior[0, slopes] = prior[slopes, 0] = -moment
    prior[slopes, slopes] = run.slope_precision
    prior[shared, shared] = 1.0
    return RunProducts(grams=grams, bounds=LARGEST_DEVIATION * sd, prior=prior)


class ChangedRuns:
    """Runs linearised at one estimate, and n changes of their outputs."""

    def __init__(self, runs: Sequence[LinearisedRun], changes: Sequence[Sequence[NDArray]]):
        """Multiply each change by the columns of its run once.

        Args:
            runs: the same estimate linearised in each of them.
            changes: n changes, each per run (values,) [noise deviations].
        """
        self._runs = list(runs)
        self._slopes = runs[0].slopes.shape[1]
        tables = [np.array([change[r] for change in changes]) for r in range(len(self._runs))]
        columns = [_columns(run) for run in runs]
        self._grams = np.array([own.T @ own for own in columns])
        self._crosses = np.array([table @ own for table, own in zip(tables, columns, strict=True)])
        self._squares = np.array([np.einsum("ij,ij->i", table, table) for table in tables])

    def explained(self, change: int) -> NormalEquations:
        """Normal equations after one change has been added to the model's outputs."""
        grams, cross = self._grams.copy(), self._crosses[:, change]
        grams[:, 0] -= cross
        grams[:, :, 0] -= cross
        grams[:, 0, 0] += self._squares[:, change]
        return equations_of(_with_priors(grams, self._runs), self._slopes)

    def with_slope(self, change: int) -> NormalEquations:
        """Normal equations with one change as a further slope, after the others."""
        place = 1 + self._slopes
        row = np.insert(self._crosses[:, change], place, self._squares[:, change], axis=1)
        grams = np.insert(np.insert(self._grams, place, 0.0, axis=1), place, 0.0, axis=2)
        grams[:, place], grams[:, :, place] = row, row
        return equations_of(_with_priors(grams, self._runs), self._slopes + 1)
