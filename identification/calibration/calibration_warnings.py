"""When not to trust a calibration."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from identification.calibration.multi_start import METHODS, best_search, reached_best
from identification.calibration.problem import CalibrationProblem
from identification.calibration.search_methods import SearchResult

NEAR_BOUND = 1e-3
"""Share of a domain within which an estimate counts as on its end."""

ILL_CONDITIONED = 30.0
"""Condition number of the normalised sensitivities from which collinearity is strong (Belsley 1980)."""

UNEXPLAINED = 1.2
"""Root mean square residual, in noise deviations, from which the model misses the recordings."""


def calibration_warnings(
    problem: CalibrationProblem, fits: Mapping[str, list[SearchResult]]
) -> list[str]:
    """Every reason for doubt, as a sentence with its figures and what to do."""
    found = []
    for method in METHODS:
        found += _not_converged(method, best_search(fits[method]))
        found += _on_bounds(problem, method, best_search(fits[method]))
        found += _other_minima(method, fits[method])
    z = best_search(fits["least squares"]).z
    found += _conditioning(problem, np.vstack(problem.least_squares().linearised(z)[1]))
    return found + _unexplained(best_search(fits["least squares"]))


def _not_converged(method: str, fit: SearchResult) -> list[str]:
    if fit.converged:
        return []
    return [
        f"{method} has not converged after {fit.evaluations} evaluations ({fit.message}): do not use "
        "its estimate; start nearer, or fit fewer parameters"
    ]


def _on_bounds(problem: CalibrationProblem, method: str, fit: SearchResult) -> list[str]:
    low, high = problem.vector.bounds.T
    margin = NEAR_BOUND * (high - low)
    at = (fit.z < low + margin) | (fit.z > high - margin)
    return [
        f"{method} ends at the end of {symbol}'s domain: the recordings ask for a value outside it, so "
        "the model lacks something or another parameter is wrong"
        for symbol, on_bound in zip(problem.vector.symbols, at, strict=True)
        if on_bound
    ]


def _other_minima(method: str, fits: list[SearchResult]) -> list[str]:
    same = reached_best(fits)
    if same[0] and np.all(same):
        return []
    others = [fit.error for fit, reached in zip(fits, same, strict=True) if not reached]
    first = "" if same[0] else "; the usual start (Table 10) is among those that do not"
    return [
        f"{method}: {np.sum(same)} of {len(fits)} starts reach the least error "
        f"{best_search(fits).error:.6g}, "
        f"the others end at {min(others):.6g} or more{first}: there are other local minima"
    ]


def _conditioning(problem: CalibrationProblem, jacobian: NDArray) -> list[str]:
    normalised = jacobian / np.maximum(np.linalg.norm(jacobian, axis=0), np.finfo(float).tiny)
    condition = float(np.linalg.cond(normalised))
    if condition < ILL_CONDITIONED:
        return []
    direction = np.abs(np.linalg.svd(normalised, full_matrices=False)[2][-1])
    involved = [s for s, w in zip(problem.vector.symbols, direction, strict=True) if w > 0.3]
    return [
        f"the recordings cannot separate {', '.join(involved)} (condition number {condition:.0f}): fix "
        "one of them, or record what moves them apart"
    ]


def _unexplained(fit: SearchResult) -> list[str]:
    if fit.error < UNEXPLAINED:
        return []
    return [
        f"the calibrated model misses the recordings by {fit.error:.3g} noise deviations (1 is the "
        "floor): the estimates absorb what the model lacks"
    ]
