"""The calibration stage: both methods from every start, errors before and after, and warnings."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from epv_env.common.files import Journal
from epv_env.plant.parameters import Parameters
from identification.calibration.calibration_warnings import calibration_warnings
from identification.calibration.multi_start import best_search, search_from_all_starts, starting_points
from identification.calibration.problem import CalibrationProblem
from identification.calibration.search_methods import SearchResult
from identification.calibration.settings import CALIBRATION, CalibrationSettings
from identification.replay.responses import Response, responses


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
    settings: CalibrationSettings = CALIBRATION
    """What the calibration was made with."""

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
    settings: CalibrationSettings = CALIBRATION,
    seed: int = 0,
) -> Calibration:
    """Fit by both methods from several starts; finished searches are kept in the journal.

    Args:
        journal: file of the finished searches.
        subject: hashes of the recordings, so that a journal of other recordings is not used.
        seed: of the starts.
    """
    points = starting_points(problem.vector, settings.starts, seed)
    symbols = list(problem.vector.symbols)
    reference = dict(problem.vector.reference)
    about = {**subject, "symbols": symbols, "reference": reference, "seed": seed}
    about |= {"bounds": problem.vector.domains.tolist(), "prior": problem.vector.known()}
    about |= {"starts": settings.starts, **settings.changed()}
    fits = search_from_all_starts(problem, points, Journal(journal, about), settings)
    after = {
        method: responses(problem.calibration, problem.vector.parameters(best_search(searches).z))
        for method, searches in fits.items()
    }
    return Calibration(
        problem=problem,
        fits=fits,
        warnings=calibration_warnings(problem, fits, settings),
        before=responses(problem.calibration, problem.vector.reference),
        after=after,
        settings=settings,
    )
