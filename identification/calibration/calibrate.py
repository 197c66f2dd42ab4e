"""The calibration stage: both methods from every start, errors before and after, and warnings."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from epv_env.common.journal import Journal
from epv_env.plant.parameters import Parameters
from identification.calibration.calibration_warnings import calibration_warnings
from identification.calibration.multi_start import best_search, search_from_all_starts, starting_points
from identification.calibration.problem import CalibrationProblem
from identification.calibration.search_methods import SearchResult
from identification.replay.responses import Response, responses

STARTS = 6
"""Table 10, and five spread over the domains."""


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """What the calibration found."""

    problem: CalibrationProblem
    fits: Mapping[str, list[SearchResult]]
    """By method, one for each start; the first start is the reference (Table 10)."""
    warnings: list[str]
    before: list[Response]
    """Of the calibration recordings at the start's parameters (Table 11)."""
    after: Mapping[str, list[Response]]
    """By method (Table 13)."""

    def best(self, method: str) -> SearchResult:
        """The least error that a method found."""
        return best_search(self.fits[method])

    def parameters(self, method: str) -> Parameters:
        """The estimate of a method."""
        return self.problem.vector.parameters(self.best(method).z)


def calibrate(
    problem: CalibrationProblem,
    *,
    journal: Path,
    subject: Mapping[str, object],
    starts: int = STARTS,
    seed: int = 0,
) -> Calibration:
    """Fit by both methods from `starts` starts; finished searches are kept in the journal.

    subject: what the recordings are (their hashes), so that a journal of others is not used.
    """
    points = starting_points(problem.vector, starts, seed)
    symbols = list(problem.vector.symbols)
    reference = dict(problem.vector.reference)
    about = {**subject, "symbols": symbols, "reference": reference, "seed": seed, "starts": starts}
    fits = search_from_all_starts(problem, points, Journal(journal, about))
    after = {
        method: responses(problem.calibration, problem.vector.parameters(best_search(found).z))
        for method, found in fits.items()
    }
    return Calibration(
        problem=problem,
        fits=fits,
        warnings=calibration_warnings(problem, fits),
        before=responses(problem.calibration, problem.vector.reference),
        after=after,
    )
