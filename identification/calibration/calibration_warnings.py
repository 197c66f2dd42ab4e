"""When not to trust a calibration."""

from collections.abc import Mapping

import numpy as np

from identification.calibration.multi_start import METHODS, best_search, reached_best
from identification.calibration.problem import CalibrationProblem
from identification.calibration.search_methods import SearchResult
from identification.calibration.settings import CALIBRATION, CalibrationSettings
from identification.recordings.noise import coarse_step_warnings


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
    warnings += _conditioning(problem, best, settings)
    return warnings + _unexplained(best, settings.unexplained)


def _not_converged(method: str, fit: SearchResult) -> list[str]:
    if fit.converged:
        return []
    return [
        f"{method} has not converged after {fit.evaluations} evaluations ({fit.message}): do not use "
        "its estimate; start nearer, or fit fewer parameters"
    ]


def symbols_on_bounds(problem: CalibrationProblem, fit: SearchResult, share: float) -> list[str]:
    """Parameters that ended within a share [1] of their domain's width from one of its ends."""
    low, high = problem.vector.bounds.T
    margin = share * (high - low)
    at = (fit.z < low + margin) | (fit.z > high - margin)
    return [symbol for symbol, on_bound in zip(problem.vector.symbols, at, strict=True) if on_bound]


def _on_bounds(problem: CalibrationProblem, method: str, fit: SearchResult, share: float) -> list[str]:
    return [
        f"{method} ends at the end of {symbol}'s domain: the recordings ask for a value outside it, so "
        "the model lacks something or another parameter is wrong"
        for symbol in symbols_on_bounds(problem, fit, share)
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


def inseparable_symbols(
    problem: CalibrationProblem, fit: SearchResult, settings: CalibrationSettings = CALIBRATION
) -> tuple[list[str], float]:
    """Parameters that the recordings cannot separate, if any, and the condition number [1]."""
    jacobian = np.vstack(problem.least_squares().linearised(fit.z)[1])
    normalised = jacobian / np.maximum(np.linalg.norm(jacobian, axis=0), np.finfo(float).tiny)
    condition = float(np.linalg.cond(normalised))
    if condition < settings.ill_conditioned:
        return [], condition
    direction = np.abs(np.linalg.svd(normalised, full_matrices=False)[2][-1])
    involved = [
        s for s, w in zip(problem.vector.symbols, direction, strict=True) if w > settings.involved_weight
    ]
    return involved, condition


def _conditioning(
    problem: CalibrationProblem, fit: SearchResult, settings: CalibrationSettings
) -> list[str]:
    involved, condition = inseparable_symbols(problem, fit, settings)
    if not involved:
        return []
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
