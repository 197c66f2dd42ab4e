"""Do the intervals hold? Campaigns whose truth is known, calibrated one after the other."""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, chi2
from threadpoolctl import threadpool_limits

from epv_env.common.journal import Journal
from epv_env.common.progress import progress
from epv_env.plant.parameters import Parameters
from epv_env.plant.valves import available_cores
from identification.bench.measurement import TrueSignals, measured_campaign, run_programme
from identification.bench.programmes import REPORT_SUITE
from identification.calibration.problem import calibration_problem
from identification.calibration.search_methods import nelder_mead, weighted_least_squares
from identification.confidence.covariance import estimate_covariance
from identification.confidence.report_interval import report_interval
from identification.confidence.settings import CONFIDENCE

CAMPAIGNS = 200


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """Shares of the campaigns in which the truth lay inside, and how the two methods compare."""

    symbols: tuple[str, ...]
    distance: NDArray
    """Squared Mahalanobis distance of the truth from the least-squares estimate (campaigns,)."""
    independent: NDArray
    """The same in the covariance that assumes independent residuals and exact inputs."""
    disagreement: NDArray
    """The same between the two methods' estimates, in the region's covariance."""
    inside: NDArray
    """Whether the truth lay in the interval of each parameter, boolean (campaigns, k)."""
    report_inside: NDArray
    """The same for eq. 23 around the Nelder-Mead estimate."""
    report_joint: NDArray
    """Whether the truth lay where eq. 23 puts all parameters at once, boolean (campaigns,)."""

    @property
    def joint(self) -> NDArray:
        """Whether the truth lay in the joint 95 % region, boolean (campaigns,)."""
        return self.distance <= chi2.ppf(CONFIDENCE.probability, len(self.symbols))

    @property
    def joint_independent(self) -> NDArray:
        """As `joint`, for the covariance that assumes independent residuals."""
        return self.independent <= chi2.ppf(CONFIDENCE.probability, len(self.symbols))

    @property
    def agree(self) -> NDArray:
        """Whether the Nelder-Mead estimate lay in the joint region, boolean (campaigns,)."""
        return self.disagreement <= chi2.ppf(CONFIDENCE.probability, len(self.symbols))


def share(hits: NDArray) -> tuple[float, float, float]:
    """Share of hits, and its exact 95 % interval (Clopper & Pearson 1934)."""
    interval = binomtest(int(np.sum(hits)), len(hits)).proportion_ci()
    return float(np.mean(hits)), float(interval.low), float(interval.high)


def coverage_study(
    *,
    journal: Path,
    truth: Parameters | None = None,
    campaigns: int = CAMPAIGNS,
    seed: int = 0,
    workers: int | None = None,
) -> Coverage:
    """Calibrate `campaigns` twin campaigns of the report's tests, each with its own sensor noise.

    truth: None is Table 12. Campaign i has the same noise whatever the number of campaigns or of
    workers. Finished campaigns are kept in the journal. Raises ValueError for less than one campaign.
    """
    if campaigns < 1:
        raise ValueError(f"a coverage study of {campaigns} campaigns shows nothing: give 1 or more")
    truth = truth or Parameters.calibrated()
    book = Journal(journal, {"study": "coverage", "truth": dict(truth), "seed": seed})
    missing = [i for i in range(campaigns) if str(i) not in book]
    if missing:
        _run(missing, truth, seed, workers or available_cores(), book)
    return _collected([book[str(i)] for i in range(campaigns)])


def _run(missing: Sequence[int], truth: Parameters, seed: int, workers: int, book: Journal) -> None:
    truths = [run_programme(truth, programme) for programme in REPORT_SUITE]
    with ProcessPoolExecutor(
        workers, get_context("spawn"), initializer=_prepare, initargs=(truths, truth, seed)
    ) as pool:
        results = zip(missing, pool.map(_calibrated, missing), strict=True)
        for index, result in progress(results, what="coverage: campaigns", total=len(missing)):
            book.add(str(index), result)


_twin: dict[str, Any] = {}
"""What every campaign of a worker shares: trajectories, truth and seed."""


def _prepare(truths: list[TrueSignals], truth: Parameters, seed: int) -> None:
    threadpool_limits(1)  # threads of the linear algebra would take the other workers' cores
    _twin.update(truths=truths, truth=truth, seed=seed)


def _calibrated(index: int) -> dict[str, Any]:
    """One campaign of the study; JSON-ready."""
    truth: Parameters = _twin["truth"]
    # One seed per campaign, not seed + index: neighbouring studies must not share campaigns.
    noise_seed = int(np.random.SeedSequence([_twin["seed"], index]).generate_state(1)[0])
    problem = calibration_problem(measured_campaign(_twin["truths"], truth, seed=noise_seed))
    start, true = problem.vector.scaled(problem.vector.reference), problem.vector.scaled(truth)
    squares, total = problem.least_squares(), problem.total_error()
    fit, simplex = weighted_least_squares(squares, start), nelder_mead(total, start)
    found = estimate_covariance(problem, squares, fit.z, seed=noise_seed)
    report = report_interval(problem, simplex.z, simplex.error)
    return {
        "symbols": list(problem.vector.symbols),
        "distance": _distance(fit.z - true, found.total),
        "independent": _distance(fit.z - true, found.independent),
        "disagreement": _distance(fit.z - simplex.z, found.total),
        "inside": _inside(
            fit.z - true, np.sqrt(chi2.ppf(CONFIDENCE.probability, 1) * np.diag(found.total))
        ),
        "report_inside": _inside(simplex.z - true, report.half_widths),
        "report_joint": report.holds_jointly(simplex.z - true),
        "seconds": {"least squares": fit.seconds, "Nelder-Mead": simplex.seconds},
    }


def _distance(apart: NDArray, covariance: NDArray) -> float:
    return float(apart @ np.linalg.solve(covariance, apart))


def _inside(apart: NDArray, half_widths: NDArray) -> list[bool]:
    return (np.abs(apart) <= half_widths).tolist()


def _collected(results: Sequence[dict[str, Any]]) -> Coverage:
    names = ("distance", "independent", "disagreement", "inside", "report_inside", "report_joint")
    columns = {name: np.array([result[name] for result in results]) for name in names}
    return Coverage(symbols=tuple(results[0]["symbols"]), **columns)
