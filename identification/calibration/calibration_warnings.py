"""When not to trust a calibration."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from identification.calibration.multi_start import METHODS, best_search, reached_best
from identification.calibration.problem import CalibrationProblem
from identification.calibration.search_methods import SearchResult
from identification.calibration.settings import CALIBRATION, CalibrationSettings
from identification.recordings.reading_steps import coarse_step_warnings


def calibration_warnings(
    problem: CalibrationProblem,
    fits: Mapping[str, list[SearchResult]],
    settings: CalibrationSettings = CALIBRATION,
) -> list[str]:
    """Every reason for doubt, as a sentence with its figures and what to do; fits: by method."""
    warnings = coarse_step_warnings(problem.steps)
    for method in METHODS:
        best = best_search(fits[method])
        warnings += _not_converged(method, best)
        warnings += _on_bounds(problem, method, best, settings.near_bound)
        warnings += _other_minima(method, fits[method], settings.same_minimum)
    best = best_search(fits["least squares"])
    jacobian = np.vstack(problem.least_squares().linearised(best.z)[1])
    warnings += _conditioning(problem, jacobian, settings)
    return warnings + _unexplained(best, settings.unexplained)


def _not_converged(method: str, fit: SearchResult) -> list[str]:
    if fit.converged:
        return []
    return [
        f"{method} has not converged after {fit.evaluations} evaluations ({fit.message}): do not use "
        "its estimate; start nearer, or fit fewer parameters"
    ]


def _on_bounds(problem: CalibrationProblem, method: str, fit: SearchResult, share: float) -> list[str]:
    low, high = problem.vector.bounds.T
    margin = share * (high - low)
    at = (fit.z < low + margin) | (fit.z > high - margin)
    return [
        f"{method} ends at the end of {symbol}'s domain: the recordings ask for a value outside it, so "
        "the model lacks something or another parameter is wrong"
        for symbol, on_bound in zip(problem.vector.symbols, at, strict=True)
        if on_bound
    ]


def _other_minima(method: str, fits: list[SearchResult], tolerance: float) -> list[str]:
    same = reached_best(fits, tolerance)
    if same[0] and np.all(same):
        return []
    others = [fit.error for fit, reached in zip(fits, same, strict=True) if not reached]
    first = "" if same[0] else "; the usual start is among those that do not"
    return [
        f"{method}: {np.sum(same)} of {len(fits)} starts reach the least error "
        f"{best_search(fits).error:.6g}, "
        f"the others end at {min(others):.6g} or more{first}: there are other local minima"
    ]


def _conditioning(
    problem: CalibrationProblem, jacobian: NDArray, settings: CalibrationSettings
) -> list[str]:
    normalised = jacobian / np.maximum(np.linalg.norm(jacobian, axis=0), np.finfo(float).tiny)
    condition = float(np.linalg.cond(normalised))
    if condition < settings.ill_conditioned:
        return []
    direction = np.abs(np.linalg.svd(normalised, full_matrices=False)[2][-1])
    involved = [
        s for s, w in zip(problem.vector.symbols, direction, strict=True) if w > settings.involved_weight
    ]
    return [
        f"the recordings cannot separate {', '.join(involved)} (condition number {condition:.0f}): fix "
        "one of them, or record what moves them apart"
    ]


def _unexplained(fit: SearchResult, limit: float) -> list[str]:
    if fit.error < limit:
        return []
    return [
        f"the calibrated model misses the recordings by {fit.error:.3g} noise deviations (1 is the "
        "floor): the estimates absorb what the model lacks"
    ]
