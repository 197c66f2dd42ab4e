"""Searches for the parameters: the report's Nelder-Mead, weighted least squares, each from many starts.

The starts show whether a minimum is the global one.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares, minimize
from scipy.stats import qmc

from epv_env.common.field_types import check_fields
from epv_env.common.files import Journal
from epv_env.common.results_folder import progress
from identification.calibration.problem import CalibrationProblem, ParameterVector, WeightedResiduals

METHODS = ("Nelder-Mead", "least squares")
"""Names of the search methods in result files."""

PRECISION = 1e-6
"""Relative change of the parameters at which a search has converged."""

MOST_EVALUATIONS = 2000
"""Evaluations of the total error; a Nelder-Mead search that needs more has not converged."""

MOST_STEPS = 200
"""Steps of a least-squares search; a search that needs more has not converged."""

SAME_MINIMUM = 1e-3
"""Relative difference of the parameters within which two searches reach the same minimum."""


@dataclass(frozen=True, kw_only=True)
class SearchResult:
    """Where a search ended, and how."""

    method: str
    """'Nelder-Mead' or 'least squares'."""
    start: NDArray
    """Scaled vector at the start, (k,)."""
    z: NDArray
    """Scaled vector at the end, (k,)."""
    error: float
    """Nelder-Mead: total error (eq. 21, a fraction). Least squares: rms in noise deviations."""
    evaluations: int
    """Of the total error, or steps of the least squares."""
    seconds: float
    """Duration of the search [s]."""
    converged: bool
    message: str
    """Of the optimiser."""

    def as_json(self) -> dict[str, Any]:
        """JSON-ready; `from_json` gives it back."""
        return {**self.__dict__, "start": self.start.tolist(), "z": self.z.tolist()}

    @classmethod
    def from_json(cls, content: Mapping[str, Any], start: NDArray) -> "SearchResult":
        """A fit as `as_json` wrote it. Raises ValueError if it has another start (k,), or no numbers."""
        arrays = {name: np.array(content[name], dtype=float) for name in ("start", "z")}
        found = cls(**{**content, **arrays})
        check_fields(found)
        if not np.array_equal(found.start, start) or found.z.shape != start.shape:
            raise ValueError("of another start")
        if not np.all(np.isfinite([found.error, found.seconds, *found.z])):
            raise ValueError("not finite")
        return found


def nelder_mead(misfit: WeightedResiduals, start: NDArray) -> SearchResult:
    """Minimise the total error by the simplex search that the report used (section 6.2).

    misfit: with the weights of the total error. start: scaled vector (k,), without unit.
    """
    options = {"xatol": PRECISION, "fatol": 1e-3 * PRECISION, "maxfev": MOST_EVALUATIONS}
    began = perf_counter()
    result = minimize(
        misfit.error, start, method="Nelder-Mead", bounds=misfit.vector.bounds, options=options
    )
    return _fit("Nelder-Mead", start, result, float(result.fun), began)


def weighted_least_squares(misfit: WeightedResiduals, start: NDArray) -> SearchResult:
    """Minimise the sum of squares in units of the noise by a trust-region Gauss-Newton method.

    What is known of the parameters before counts like readings do.

    misfit: with the weights of the noise. start: scaled vector (k,), without unit.
    """
    began = perf_counter()
    result = least_squares(
        lambda z: np.concatenate([*misfit.residuals(z), misfit.vector.prior(z)[0]]),
        start,
        jac=lambda z: np.vstack([*misfit.linearised(z)[1], misfit.vector.prior(z)[1]]),  # type: ignore[arg-type]
        bounds=misfit.vector.bounds.T,
        xtol=PRECISION,
        ftol=PRECISION,
        max_nfev=MOST_STEPS,
    )
    rms = float(np.sqrt(np.mean(np.square(result.fun))))
    return _fit("least squares", start, result, rms, began)


def _fit(
    method: str, start: NDArray, result: OptimizeResult, error: float, began: float
) -> SearchResult:
    return SearchResult(
        method=method,
        start=np.asarray(start, dtype=float),
        z=np.asarray(result.x, dtype=float),
        error=error,
        evaluations=int(result.nfev),
        seconds=perf_counter() - began,
        converged=bool(result.success),
        message=str(result.message),
    )


def starting_points(vector: ParameterVector, count: int, seed: int) -> NDArray:
    """Scaled vectors (count, k), without unit: the reference, then a Latin hypercube over the domains.

    Each symbol is spread evenly over the logarithm of its domain, of which RML's spans a decade; over
    the domain itself where that holds zero.
    """
    low, high = vector.bounds.T
    draws = qmc.LatinHypercube(len(vector.symbols), rng=np.random.default_rng(seed)).random(count - 1)
    positive = low > 0
    ratio = np.where(positive, high, 1.0) / np.where(positive, low, 1.0)
    spread = np.where(positive, low * ratio**draws, low + (high - low) * draws)
    return np.vstack([vector.scaled(vector.reference), spread])


def search_from_all_starts(
    problem: CalibrationProblem, starts: NDArray, journal: Journal
) -> dict[str, list[SearchResult]]:
    """Both methods from every start; finished searches are taken from the journal.

    starts: scaled vectors (starts, k), without unit. Returns the searches by method.
    """
    misfits = {"Nelder-Mead": problem.total_error(), "least squares": problem.least_squares()}
    searches = {"Nelder-Mead": nelder_mead, "least squares": weighted_least_squares}
    searched: dict[str, list[SearchResult]] = {method: [] for method in METHODS}
    tasks = [(method, index) for index in range(len(starts)) for method in METHODS]
    for method, index in progress(tasks, what="calibrate: searches"):
        name = f"{method} {index}"
        if name not in journal:
            journal.add(name, searches[method](misfits[method], starts[index]).as_json())
        read = partial(SearchResult.from_json, start=starts[index])
        searched[method].append(journal.read(name, read))
    return searched


def best_search(fits: list[SearchResult]) -> SearchResult:
    """The search that ended at the least error."""
    return min(fits, key=lambda fit: fit.error)


def reached_best(fits: list[SearchResult]) -> NDArray:
    """Which searches ended at the same minimum as the best, boolean (starts,)."""
    ends, goal = np.array([fit.z for fit in fits]), best_search(fits).z
    return np.all(np.abs(ends - goal) <= SAME_MINIMUM * np.maximum(np.abs(goal), SAME_MINIMUM), axis=1)
