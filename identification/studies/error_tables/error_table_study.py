"""Which causes the published error tables of the real valve speak for: tables.json and tables.html."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from identification.report.page import Section
from identification.report.result_files import write_results
from identification.studies.error_tables.candidates import Candidate
from identification.studies.error_tables.error_prediction import (
    printed_calibrated_errors,
    printed_initial_errors,
)
from identification.studies.error_tables.error_table_figures import ranking_figure
from identification.studies.error_tables.error_table_section import sections
from identification.studies.error_tables.ranking import CauseMatch, inseparable_causes
from identification.studies.error_tables.ranking_reliability import RankingReliability
from identification.studies.error_tables.results import ErrorTableResults, error_table_results
from identification.studies.error_tables.settings import DEFAULTS, ErrorTableSettings


def error_table_study(
    out: Path,
    *,
    seed: int = 0,
    images: Path | None = None,
    causes: Sequence[str] | None = None,
    settings: ErrorTableSettings = DEFAULTS,
) -> list[Section]:
    """Rank the causes by Tables 11, 13 and 15, write both files, and return the sections.

    Args:
        out: folder of tables.json and tables.html.
        seed: of the test conditions and made-up tables.
        images: folder for real-bench.png; None draws no picture.
        causes: rank these only; None ranks all.
        settings: of the study.
    """
    results = error_table_results(seed=seed, causes=causes, settings=settings)
    page = sections(results)
    title = "What the printed error tables say of the real valve"
    write_results(out, "tables", title=title, sections=page, content=tables_json(results))
    if images is not None:
        images.mkdir(parents=True, exist_ok=True)
        ranking_figure(results).savefig(images / "real-bench.png", dpi=110)
    return page


def tables_json(results: ErrorTableResults) -> dict[str, Any]:
    """JSON-ready; errors in percent, sizes in SI units."""
    return {
        "seed": results.seed,
        "draws": len(results.tables.conditions),
        "tolerance": results.settings.tolerance,
        "printed": {
            "after": printed_calibrated_errors().tolist(),
            "before": printed_initial_errors().tolist(),
        },
        "current": {
            "residual": {name: value.tolist() for name, value in vars(results.residual).items()},
            "winding_K": np.median(results.winding.temperature, axis=0).tolist(),
            "winding_share": np.median(results.winding.share, axis=0).tolist(),
        },
        "alone": [_match_json(match) for match in results.singles],
        "pairs": [_match_json(match) for match in results.pairs],
        "inseparable": {
            "alone": inseparable_causes(results.singles, results.settings),
            "pairs": inseparable_causes(results.pairs, results.settings),
        },
        "probability": results.probability,
        "trust": _reliability_json(results.reliability),
    }


def _match_json(match: CauseMatch) -> dict[str, Any]:
    return {
        "cause": match.cause,
        "size": _size_json(match.candidate),
        "factor": match.median,
        "factor_interval": list(match.interval),
        "factor_of_current": match.current_factor,
        "factor_of_pressures": match.pressure_factor,
        "factor_of_table11": match.initial_factor,
        "share_first": match.share_nearest,
        "verdict": match.verdict,
        "predicted_percent": match.predicted.tolist(),
    }


def _size_json(candidate: Candidate) -> dict[str, float]:
    others = {
        "winding_between_tests_K": candidate.winding_deviation,
        "current_lag_s": candidate.current_lag,
    }
    return {**candidate.changes, **{name: size for name, size in others.items() if size}}


def _reliability_json(reliability: RankingReliability) -> dict[str, Any]:
    return {
        "width": reliability.kernel_width,
        "first": reliability.current_cause_first,
        "within": reliability.current_cause_in_set,
        "second": reliability.pressure_cause_in_set,
        "n": reliability.tables,
    }
