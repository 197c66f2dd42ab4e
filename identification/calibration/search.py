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
from scipy.optimize import minimize
from scipy.stats import qmc

from epv_env.common.field_types import check_fields, numbers
from epv_env.common.files import Journal
from epv_env.common.results_folder import progress
from identification.calibration.problem import CalibrationProblem, ParameterVector
from identification.gap.fit.evidence import predict
from identification.gap.fit.fitting_problem import Hypothesis
from identification.gap.fit.recalibration import recalibrate
from identification.report_2003 import partial_error, relative_error, total_error

METHODS = ("Nelder-Mead", "least squares")
"""Names of the search methods in result files."""

PRECISION = 1e-6
"""Relative change of the parameters at which a Nelder-Mead search has converged."""

LEAST_SQUARES_PRECISION = 1e-4
"""Precision of the least squares [1]: 0.3 of chi-square times it are a hundredth of a standard error."""

MOST_EVALUATIONS = 2000
"""Evaluations of the total error; a Nelder-Mead search that needs more has not converged."""

MOST_STEPS = 100
"""Steps of each fit of a least-squares search; a search that needs more has not converged."""

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
        arrays = {name: numbers(content[name], *start.shape) for name in ("start", "z")}
        found = cls(**{**content, **arrays})
        check_fields(found)
        numbers([found.error, found.seconds], 2)
        if not np.array_equal(found.start, start):
            raise ValueError("of another start")
        return found


class TotalError:
    """The report's objective: the total error (eqs 19 to 21) of the calibration recordings.

    Each recording has its own circuit pressure at the start and its own zeros of sensors.
    """

    def __init__(self, problem: CalibrationProblem):
        """Take the nuisances' derivatives at the reference."""
        self.vector = problem.vector
        self._fitting = problem.fitting(self.vector.scaled(self.vector.reference))
        self._noise = np.array([[channel.known_noise] for channel in problem.plant.channels])

    def __call__(self, z: NDArray) -> float:
        """Of a scaled vector (k,), a fraction."""
        estimate = self._fitting.start(Hypothesis(causes=()), self.vector.named(z))
        residuals = predict(self._fitting, estimate).residuals
        partials = [
            partial_error(
                [
                    relative_error(measured, measured - deviation, run.time)
                    for measured, deviation in zip(run.measured, self._noise * own, strict=True)
                ]
            )
            for run, own in zip(self._fitting.plant.runs, residuals, strict=True)
        ]
        return float(total_error(partials))


def nelder_mead(problem: CalibrationProblem, start: NDArray) -> SearchResult:
    """Minimise the total error by the simplex search that the report used (section 6.2).

    start: scaled vector (k,), without unit.
    """
    options = {"xatol": PRECISION, "fatol": 1e-3 * PRECISION, "maxfev": MOST_EVALUATIONS}
    began = perf_counter()
    result = minimize(
        TotalError(problem), start, method="Nelder-Mead", bounds=problem.vector.bounds, options=options
    )
    return SearchResult(
        method="Nelder-Mead",
        start=np.asarray(start, dtype=float),
        z=np.asarray(result.x, dtype=float),
        error=float(result.fun),
        evaluations=int(result.nfev),
        seconds=perf_counter() - began,
        converged=bool(result.success),
        message=str(result.message),
    )


def weighted_least_squares(problem: CalibrationProblem, start: NDArray) -> SearchResult:
    """Minimise the sum of squares in units of the noise, as the diagnosis recalibrates.

    What is known of the parameters before counts like readings do. start: scaled vector (k,), without
    unit.
    """
    began = perf_counter()
    fitting, estimate = recalibrate(
        problem.plant,
        start=problem.vector.named(start),
        iterations=MOST_STEPS,
        precision=LEAST_SQUARES_PRECISION,
    )
    return SearchResult(
        method="least squares",
        start=np.asarray(start, dtype=float),
        z=estimate.vector,
        error=float(np.sqrt(estimate.chi_square / fitting.readings)),
        evaluations=estimate.steps,
        seconds=perf_counter() - began,
        converged=estimate.converged,
        message="converged" if estimate.converged else f"stopped after {MOST_STEPS} steps",
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
    searches = {"Nelder-Mead": nelder_mead, "least squares": weighted_least_squares}
    searched: dict[str, list[SearchResult]] = {method: [] for method in METHODS}
    tasks = [(method, index) for index in range(len(starts)) for method in METHODS]
    for method, index in progress(tasks, what="calibrate: searches"):
        name = f"{method} {index}"
        if name not in journal:
            journal.add(name, searches[method](problem, starts[index]).as_json())
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
