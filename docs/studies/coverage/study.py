"""How often the confidence intervals hold the truth: twin campaigns, calibrated one by one.

    python -m docs.studies.coverage.study

writes coverage.json and the table of README.md. The truth of each virtual campaign is
Table 12; its noise is its own. Finished campaigns are kept in runs/coverage/CODE and not repeated.
"""

import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest, chi2
from threadpoolctl import threadpool_limits

from docs.studies.common import PAGE, fill, study_options, study_parser, table
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import Journal, write_json
from epv_env.common.results_folder import progress
from epv_env.plant.parameters import Parameters
from epv_env.plant.valves import available_cores
from identification.bench.programmes import REPORT_SUITE
from identification.bench.session import TrueSignals, measured_campaign, run_programme
from identification.calibration.problem import calibration_problem
from identification.calibration.search import weighted_least_squares
from identification.confidence import estimate_covariance

FOLDER = Path(__file__).parent
CAMPAIGNS, QUICK = 200, 1
"""Campaigns: a coverage of 0.95 is then known to about ±0.03."""
PROBABILITY = 0.95
"""Of the intervals and regions [-]."""


def calibrated_campaigns(journal: Path, *, campaigns: int, seed: int) -> list[dict[str, Any]]:
    """Where the truth lies relative to the estimates of each campaign; see `calibrated`.

    Campaign i has the same noise whatever the number of campaigns.
    """
    subject = {"study": "coverage", "truth": dict(Parameters.calibrated()), "seed": seed}
    results = Journal(journal, subject)
    # One seed per campaign, not seed + index: neighbouring studies must not share campaigns.
    seeds = [int(np.random.SeedSequence([seed, i]).generate_state(1)[0]) for i in range(campaigns)]
    missing = [i for i in range(campaigns) if str(i) not in results]
    with ProcessPoolExecutor(available_cores(), get_context("spawn"), threadpool_limits, (1,)) as pool:
        found = zip(missing, pool.map(calibrated, [seeds[i] for i in missing]), strict=True)
        for index, result in progress(found, what="coverage: campaigns", total=len(missing)):
            results.add(str(index), result)
    return [results[str(i)] for i in range(campaigns)]


def calibrated(noise_seed: int) -> dict[str, Any]:
    """The calibration of one campaign, JSON-ready.

    `distance`: squared Mahalanobis distance of the truth from the estimate. `inside`: whether the
    intervals hold the truth.
    """
    problem = calibration_problem(measured_campaign(_truths(), Parameters.calibrated(), seed=noise_seed))
    fit = weighted_least_squares(problem, problem.vector.scaled(problem.vector.reference))
    covariance, _ = estimate_covariance(problem, fit.z)
    apart = fit.z - problem.vector.scaled(Parameters.calibrated())
    half_widths = np.sqrt(chi2.ppf(PROBABILITY, 1) * np.diag(covariance))
    return {
        "symbols": list(problem.vector.symbols),
        "distance": float(apart @ np.linalg.solve(covariance, apart)),
        "inside": (np.abs(apart) <= half_widths).tolist(),
    }


def coverage(campaigns: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """Share of campaigns by kind of interval [-], with the ends of its exact 95 % interval."""
    symbols = campaigns[0]["symbols"]
    limit = chi2.ppf(PROBABILITY, len(symbols))
    cases = {"joint region": [c["distance"] <= limit for c in campaigns]}
    for i, symbol in enumerate(symbols):
        cases[f"interval of {symbol}"] = [c["inside"][i] for c in campaigns]
    shares = {}
    for name, held in cases.items():
        ends = binomtest(sum(held), len(held)).proportion_ci()
        shares[name] = {"share": sum(held) / len(held), "low": float(ends.low), "high": float(ends.high)}
    return shares


@cache
def _truths() -> list[TrueSignals]:
    """The noise-free recordings of the report's tests, the same for all campaigns."""
    return [run_programme(Parameters.calibrated(), programme) for programme in REPORT_SUITE]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    parser = study_parser(__doc__ or "", FOLDER)
    parser.add_argument("--seed", type=int, default=0, help="of the campaigns' noise")
    options = study_options(parser, arguments)
    count = QUICK if options.quick else CAMPAIGNS
    found = calibrated_campaigns(options.work / "coverage.jsonl", campaigns=count, seed=options.seed)
    shares = coverage(found)
    write_json(options.out / "coverage.json", shares)
    rows = [[name, *(f"{100 * value:.1f}" for value in held.values())] for name, held in shares.items()]
    fill(options.out / PAGE, {"coverage": table(["", "Share [%]", "low", "high"], rows)})
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
