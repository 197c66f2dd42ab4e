"""Searches from many starts, to show whether a minimum is the global one."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from epv_env.common.files import Journal
from epv_env.common.results_folder import progress
from identification.calibration.problem import CalibrationProblem
from identification.calibration.search_methods import SearchResult, nelder_mead, weighted_least_squares
from identification.calibration.settings import CALIBRATION, CalibrationSettings
from identification.replay.parameter_vector import ParameterVector

METHODS = ("Nelder-Mead", "least squares")
"""Names of the search methods; result files carry them."""


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
    problem: CalibrationProblem,
    starts: NDArray,
    journal: Journal,
    settings: CalibrationSettings = CALIBRATION,
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
            journal.add(name, searches[method](misfits[method], starts[index], settings).as_json())
        searched[method].append(SearchResult.from_json(journal[name]))
    return searched


def best_search(fits: list[SearchResult]) -> SearchResult:
    """The search that ended at the least error."""
    return min(fits, key=lambda fit: fit.error)


def reached_best(fits: list[SearchResult], tolerance: float = CALIBRATION.same_minimum) -> NDArray:
    """Which searches ended within a relative `tolerance` of the best, boolean (starts,)."""
    ends, goal = np.array([fit.z for fit in fits]), best_search(fits).z
    return np.all(np.abs(ends - goal) <= tolerance * np.maximum(np.abs(goal), tolerance), axis=1)
