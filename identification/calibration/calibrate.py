"""The calibration (section 6.2): both methods from every start, errors before and after, warnings.

In the report: Tables 10 to 13 and the worst of Figures 10 to 13.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from epv_env.common.files import Journal
from epv_env.plant.parameters import Parameters, table
from epv_env.plant.region import correlation
from identification.calibration.problem import CalibrationProblem
from identification.calibration.search import (
    METHODS,
    SearchResult,
    best_search,
    reached_best,
    search_from_all_starts,
    starting_points,
)
from identification.recordings.noise import coarse_step_warnings
from identification.replay.replay import (
    Response,
    error_table,
    errors_as_json,
    percent,
    responses,
    total_response_error,
    worst_picture,
)
from identification.report.page import Section, Table, Verdict
from identification.report_2003 import ACCEPTED_ERROR

STARTS = 6
"""Searches of each method: one from the reference, the others spread over the domains."""

NEAR_BOUND = 1e-3
"""Share of a domain's width from its end, within which an estimate counts as on that end."""

EXPLAINED = 1.2
"""Root mean square residual, in noise deviations, up to which the model explains the recordings."""


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Searches of both methods, the model's errors before and after, and the reasons for doubt."""

    problem: CalibrationProblem
    fits: Mapping[str, list[SearchResult]]
    """By method, one for each start; the first start is the reference (Table 10, or the plant file)."""
    warnings: list[str]
    before: list[Response]
    """Of the calibration recordings at the start's parameters (Table 11)."""
    after: Mapping[str, list[Response]]
    """By method (Table 13)."""

    def best(self, method: str) -> SearchResult:
        """The search of a method that ended at the least error."""
        return best_search(self.fits[method])

    def parameters(self, method: str) -> Parameters:
        """The estimate of a method [SI]."""
        return self.problem.vector.parameters(self.best(method).z)


def calibrate(
    problem: CalibrationProblem,
    *,
    journal: Path,
    subject: Mapping[str, object],
    starts: int = STARTS,
    seed: int = 0,
) -> Calibration:
    """Fit by both methods from several starts; finished searches are kept in the journal.

    Args:
        journal: file of the finished searches.
        subject: of the plant, and hashes of the recordings: a journal of others is not used.
        starts: searches of each method.
        seed: of the starts.
    """
    points = starting_points(problem.vector, starts, seed)
    symbols = list(problem.vector.symbols)
    reference = dict(problem.vector.reference)
    about = {**subject, "symbols": symbols, "reference": reference, "seed": seed, "starts": starts}
    about |= {"bounds": problem.vector.domains.tolist(), "prior": problem.vector.known()}
    fits = search_from_all_starts(problem, points, Journal(journal, about))
    after = {
        method: responses(problem.calibration, problem.vector.parameters(best_search(searches).z))
        for method, searches in fits.items()
    }
    return Calibration(
        problem=problem,
        fits=fits,
        warnings=calibration_warnings(problem, fits),
        before=responses(problem.calibration, problem.vector.reference),
        after=after,
    )


def calibration_warnings(
    problem: CalibrationProblem, fits: Mapping[str, list[SearchResult]]
) -> list[str]:
    """Every reason for doubt, as a sentence with its figures and what to do; fits: by method."""
    warnings = coarse_step_warnings(problem.steps)
    for method in METHODS:
        best = best_search(fits[method])
        if not best.converged:
            warnings.append(
                f"{method} has not converged after {best.evaluations} evaluations ({best.message}): do "
                "not use its estimate; start nearer, or fit fewer parameters"
            )
        warnings += [
            f"{method} ends at the end of {symbol}'s domain: the recordings ask for a value outside it, "
            "so the model lacks something or another parameter is wrong"
            for symbol in symbols_on_bounds(problem, best)
        ]
        warnings += _other_minima(method, fits[method])
    best = best_search(fits["least squares"])
    involved, condition = inseparable_symbols(problem, best)
    if involved:
        warnings.append(
            f"the recordings cannot separate {', '.join(involved)} (condition number {condition:.0f}): "
            "fix one of them, or record what moves them apart"
        )
    if best.error >= EXPLAINED:
        warnings.append(
            f"the calibrated model misses the recordings by {best.error:.3g} noise deviations (1 is the "
            "floor): the estimates absorb what the model lacks"
        )
    return warnings


def symbols_on_bounds(problem: CalibrationProblem, fit: SearchResult) -> list[str]:
    """Parameters that ended on an end of their domain."""
    low, high = problem.vector.bounds.T
    margin = NEAR_BOUND * (high - low)
    at = (fit.z < low + margin) | (fit.z > high - margin)
    return [symbol for symbol, on_bound in zip(problem.vector.symbols, at, strict=True) if on_bound]


def _other_minima(method: str, fits: list[SearchResult]) -> list[str]:
    same = reached_best(fits)
    if same[0] and np.all(same):
        return []
    others = [fit.error for fit, reached in zip(fits, same, strict=True) if not reached]
    first = "" if same[0] else "; the usual start is among those that do not"
    return [
        f"{method}: {np.sum(same)} of {len(fits)} starts reach the least error "
        f"{best_search(fits).error:.6g}, "
        f"the others end at {min(others):.6g} or more{first}: there are other local minima"
    ]


def inseparable_symbols(problem: CalibrationProblem, fit: SearchResult) -> tuple[list[str], float]:
    """Parameters that the recordings cannot separate, if any, and the condition number [1].

    Collinearity is strong from 30 on (Belsley 1980); the parameters are those with weight in the
    flattest direction.
    """
    information = np.linalg.inv(correlation(problem.evaluated(fit.z).covariance))
    values, vectors = np.linalg.eigh(correlation(information))
    condition = float(np.sqrt(values[-1] / max(values[0], np.finfo(float).tiny)))
    if condition < 30.0:
        return [], condition
    direction = np.abs(vectors[:, 0])
    involved = [s for s, w in zip(problem.vector.symbols, direction, strict=True) if w > 0.3]
    return involved, condition


def calibration_section(calibration: Calibration) -> Section:
    """Estimates of both methods, errors before and after, and what speaks against them."""
    return Section(
        title="Calibration",
        verdicts=[
            _verdict(calibration),
            *(Verdict(status="doubt", text=warning) for warning in calibration.warnings),
        ],
        blocks=[
            _estimates(calibration),
            _offsets(calibration),
            _starts(calibration),
            error_table(calibration.before, "Errors at the start's parameters."),
            *(error_table(calibration.after[method], f"Errors after {method}.") for method in METHODS),
            worst_picture(calibration.after["least squares"]),
        ],
    )


def calibration_json(calibration: Calibration) -> dict[str, Any]:
    """Estimates in SI units, errors in percent, every search, and the warnings."""
    return {
        "estimates": {
            method: {s: calibration.parameters(method)[s] for s in calibration.problem.vector.symbols}
            for method in METHODS
        },
        "start": {
            s: calibration.problem.vector.reference[s] for s in calibration.problem.vector.symbols
        },
        "errors_before": errors_as_json(calibration.before),
        "errors_after": {m: errors_as_json(calibration.after[m]) for m in METHODS},
        "offsets_subtracted": {name: o.value for name, o in calibration.problem.offsets.items()},
        "noise": dict(calibration.problem.noise),
        "searches": {m: [fit.as_json() for fit in calibration.fits[m]] for m in METHODS},
        "warnings": calibration.warnings,
    }


def _verdict(calibration: Calibration) -> Verdict:
    error = total_response_error(calibration.after["Nelder-Mead"])
    before = total_response_error(calibration.before)
    rms = calibration.best("least squares").error
    good = error < ACCEPTED_ERROR
    return Verdict(
        status="good" if good else "bad",
        text=f"The total error falls from {percent(before)} to {percent(error)} %, "
        f"{'below' if good else 'not below'} the limit of {100 * ACCEPTED_ERROR:.0f} %; the "
        f"residual of the least-squares fit is {rms:.3g} times the noise (1 is the floor).",
    )


def _estimates(calibration: Calibration) -> Table:
    vector = calibration.problem.vector
    rows = []
    for symbol, (low, high) in zip(vector.symbols, vector.domains.tolist(), strict=True):
        row = table()[symbol]
        values = (vector.reference, *(calibration.parameters(method) for method in METHODS))
        name = f"{symbol} ({row.meaning}) [{row.unit}]"
        rows.append([name, *(f"{p[symbol]:.7g}" for p in values), f"{low:g} to {high:g}"])
    columns = ["Parameter", "start", *METHODS, "domain"]
    return Table(columns=columns, rows=rows, caption="Estimates.")


def _offsets(calibration: Calibration) -> str:
    offsets = calibration.problem.offsets
    if not offsets:
        return (
            "No record at rest shows the sensors' offsets: readings were taken as they are, so an error "
            "of the supply's, the circuit's or the voltage's sensor goes into the estimates."
        )
    listed = ", ".join(f"{name} {offset.value:.4g}" for name, offset in offsets.items())
    return f"Offsets at rest that were subtracted from the readings [A, V, Pa]: {listed}."


def _starts(calibration: Calibration) -> Table:
    scale = calibration.problem.vector.scale
    rows = [
        [
            method,
            ", ".join(f"{value:.4g}" for value in fit.start * scale),
            f"{fit.error:.5g}",
            "yes" if reached else "no",
            str(fit.evaluations),
            f"{fit.seconds:.2f}",
        ]
        for method, fits in calibration.fits.items()
        for fit, reached in zip(fits, reached_best(fits), strict=True)
    ]
    columns = ["Method", "start", "error at the end", "reaches the best", "evaluations", "time [s]"]
    caption = (
        f"Searches from several starts ({', '.join(calibration.problem.vector.symbols)}); error: the "
        "total error as a fraction for Nelder-Mead, rms in noise deviations for least squares."
    )
    return Table(columns=columns, rows=rows, caption=caption)
