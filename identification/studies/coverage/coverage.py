"""Coverage of the confidence intervals: virtual campaigns of known truth, calibrated one by one."""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from epv_env.common.command_line import ignore_interrupts
from epv_env.common.files import Journal
from epv_env.common.results_folder import progress
from epv_env.plant.parameters import Parameters
from epv_env.plant.valves import available_cores
from identification.bench.programmes import REPORT_SUITE
from identification.bench.session import TrueSignals, measured_campaign, run_programme
from identification.calibration.problem import calibration_problem
from identification.calibration.search_methods import nelder_mead, weighted_least_squares
from identification.confidence.covariance import estimate_covariance
from identification.confidence.report_interval import report_interval
from identification.confidence.settings import CONFIDENCE

CAMPAIGNS = 200
"""Campaigns of a study: a coverage of 0.95 is then known to about ±0.03."""


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """Where the truth of each of m campaigns lies relative to the estimates of k parameters."""

    symbols: tuple[str, ...]
    """The k calibrated parameters."""
    distance: NDArray
    """Squared Mahalanobis distance of the truth from the least-squares estimate [-], (m,)."""
    independent: NDArray
    """The same with the covariance for independent residuals and exact inputs [-], (m,)."""
    disagreement: NDArray
    """The same between the Nelder-Mead and the least-squares estimate [-], (m,)."""
    inside: NDArray
    """Whether the truth lies in the interval of each parameter, boolean (m, k)."""
    report_inside: NDArray
    """The same for eq. 23 around the Nelder-Mead estimate, boolean (m, k)."""
    report_joint: NDArray
    """Whether the truth lies where eq. 23 puts all parameters at once, boolean (m,)."""

    @property
    def joint(self) -> NDArray:
        """Whether the truth lies in the joint 95 % region, boolean (m,)."""
        return self._in_region(self.distance)

    @property
    def joint_independent(self) -> NDArray:
        """As `joint`, with the covariance that assumes independent residuals, boolean (m,)."""
        return self._in_region(self.independent)

    @property
    def agree(self) -> NDArray:
        """Whether the Nelder-Mead estimate lies in the joint 95 % region, boolean (m,)."""
        return self._in_region(self.disagreement)

    def _in_region(self, squared_distance: NDArray) -> NDArray:
        return squared_distance <= chi2.ppf(CONFIDENCE.probability, len(self.symbols))


def coverage_study(
    *,
    journal: Path,
    truth: Parameters | None = None,
    campaigns: int = CAMPAIGNS,
    seed: int = 0,
    workers: int | None = None,
) -> Coverage:
    """Calibrate virtual campaigns of the report's tests, each with sensor noise of its own.

    Campaign i has the same noise whatever the number of campaigns or workers.

    Args:
        journal: file that keeps finished campaigns; a later call calibrates the missing ones only.
        truth: parameters of the virtual bench; None is Table 12.
        campaigns: number of campaigns m.
        seed: of the noise.
        workers: processes; None is one per core.

    Raises:
        ValueError: there is less than one campaign.
    """
    if campaigns < 1:
        raise ValueError(f"a coverage study of {campaigns} campaigns shows nothing: give 1 or more")
    truth = truth or Parameters.calibrated()
    results = Journal(journal, {"study": "coverage", "truth": dict(truth), "seed": seed})
    missing = [i for i in range(campaigns) if str(i) not in results]
    if missing:
        _calibrate_missing(missing, truth, seed, workers or available_cores(), results)
    return _joined([results[str(i)] for i in range(campaigns)])


def _calibrate_missing(
    missing: Sequence[int], truth: Parameters, seed: int, workers: int, journal: Journal
) -> None:
    truths = [run_programme(truth, programme) for programme in REPORT_SUITE]
    with ProcessPoolExecutor(
        workers, get_context("spawn"), initializer=_prepare_worker, initargs=(truths, truth, seed)
    ) as pool:
        results = zip(missing, pool.map(_calibrated, missing), strict=True)
        for index, result in progress(results, what="coverage: campaigns", total=len(missing)):
            journal.add(str(index), result)


_worker: dict[str, Any] = {}
"""What all campaigns of a worker process share: noise-free recordings, truth and seed."""


def _prepare_worker(truths: list[TrueSignals], truth: Parameters, seed: int) -> None:
    ignore_interrupts()
    threadpool_limits(1)  # threads of the linear algebra would take the other workers' cores
    _worker.update(truths=truths, truth=truth, seed=seed)


def _calibrated(index: int) -> dict[str, Any]:
    """The calibration of one campaign, JSON-ready: fields of Coverage for this campaign."""
    truth: Parameters = _worker["truth"]
    # One seed per campaign, not seed + index: neighbouring studies must not share campaigns.
    noise_seed = int(np.random.SeedSequence([_worker["seed"], index]).generate_state(1)[0])
    problem = calibration_problem(measured_campaign(_worker["truths"], truth, seed=noise_seed))
    start, true = problem.vector.scaled(problem.vector.reference), problem.vector.scaled(truth)
    squares, total = problem.least_squares(), problem.total_error()
    fit, simplex = weighted_least_squares(squares, start), nelder_mead(total, start)
    estimate = estimate_covariance(problem, squares, fit.z, seed=noise_seed)
    report = report_interval(problem, simplex.z, simplex.error)
    half_widths = np.sqrt(chi2.ppf(CONFIDENCE.probability, 1) * np.diag(estimate.total))
    return {
        "symbols": list(problem.vector.symbols),
        "distance": _squared_distance(fit.z - true, estimate.total),
        "independent": _squared_distance(fit.z - true, estimate.independent),
        "disagreement": _squared_distance(fit.z - simplex.z, estimate.total),
        "inside": _inside(fit.z - true, half_widths),
        "report_inside": _inside(simplex.z - true, report.half_widths),
        "report_joint": report.holds_jointly(simplex.z - true),
        "seconds": {"least squares": fit.seconds, "Nelder-Mead": simplex.seconds},
    }


def _squared_distance(deviation: NDArray, covariance: NDArray) -> float:
    """Squared Mahalanobis distance of a deviation (k,) in a covariance (k, k)."""
    return float(deviation @ np.linalg.solve(covariance, deviation))


def _inside(deviation: NDArray, half_widths: NDArray) -> list[bool]:
    return (np.abs(deviation) <= half_widths).tolist()


def _joined(results: Sequence[dict[str, Any]]) -> Coverage:
    """The campaigns' results as arrays."""
    names = ("distance", "independent", "disagreement", "inside", "report_inside", "report_joint")
    columns = {name: np.array([result[name] for result in results]) for name in names}
    return Coverage(symbols=tuple(results[0]["symbols"]), **columns)
