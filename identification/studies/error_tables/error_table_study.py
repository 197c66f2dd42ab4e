"""Which causes the published error tables of the real valve speak for: tables.json and tables.html."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from identification.report.page import Section
from identification.report.result_files import write_results
from identification.studies.error_tables import error_table_figures as figures
from identification.studies.error_tables.candidates import Candidate
from identification.studies.error_tables.error_table_section import sections
from identification.studies.error_tables.patterns import printed_after, printed_before
from identification.studies.error_tables.ranking import TOLERANCE, Match, inseparable
from identification.studies.error_tables.results import DRAWS, Study, study


def real_bench(
    out: Path,
    *,
    seed: int = 0,
    images: Path | None = None,
    draws: int = DRAWS,
    causes: Sequence[str] | None = None,
) -> list[Section]:
    """Rank the causes by Tables 11, 13 and 15, write both files, and return the sections.

    images: folder for real-bench.png. draws: sets of test conditions. causes: None for all.
    """
    found = study(seed=seed, draws=draws, causes=causes)
    page = sections(found)
    title = "What the printed error tables say of the real valve"
    write_results(out, "tables", title=title, sections=page, content=as_json(found))
    if images is not None:
        images.mkdir(parents=True, exist_ok=True)
        figures.ranking(found).savefig(images / "real-bench.png", dpi=110)
    return page


def as_json(found: Study) -> dict[str, Any]:
    """JSON-ready; errors in percent, sizes in SI units."""
    return {
        "seed": found.seed,
        "draws": len(found.library.conditions),
        "tolerance": TOLERANCE,
        "printed": {"after": printed_after().tolist(), "before": printed_before().tolist()},
        "current": {
            "residual": {name: value.tolist() for name, value in vars(found.residual).items()},
            "winding_K": np.median(found.winding.warmth, axis=0).tolist(),
            "winding_share": np.median(found.winding.share, axis=0).tolist(),
        },
        "alone": [_match(match) for match in found.singles],
        "pairs": [_match(match) for match in found.checked],
        "inseparable": {
            "alone": inseparable(found.singles),
            "pairs": inseparable(found.checked),
        },
        "probability": found.probability,
        "trust": vars(found.trust),
    }


def _match(match: Match) -> dict[str, Any]:
    return {
        "cause": match.cause,
        "size": _size(match.candidate),
        "factor": match.median,
        "factor_interval": list(match.interval),
        "factor_of_current": match.current,
        "factor_of_pressures": match.pressures,
        "factor_of_table11": match.before,
        "share_first": match.first,
        "verdict": match.verdict,
        "predicted_percent": match.predicted.tolist(),
    }


def _size(candidate: Candidate) -> dict[str, float]:
    others = {"winding_between_tests_K": candidate.warmth, "current_lag_s": candidate.lag}
    return {**candidate.changes, **{name: size for name, size in others.items() if size}}
