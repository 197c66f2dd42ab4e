"""What a sweep writes and prints: results.json, tables as CSV, figures."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from epv_env.common.files import write_text
from training.evaluation.rollout import Trace
from training.studies.episode_tasks import Study
from training.studies.generated_pages import fill
from training.studies.parallel_run import Outcome
from training.studies.sweeps.computing_cost import MACHINES
from training.studies.sweeps.episode_plan import SweepCell
from training.studies.sweeps.markdown_tables import (
    cost_table,
    harmful_changes_table,
    joint_table,
    worst_table,
)
from training.studies.sweeps.result_tables import point_table, rank_correlation_table
from training.studies.sweeps.worst_case_search import Search

FORMAT = "epv-sweep/1"

PARTS = ("joint", "one at a time", "worst", "cost")
"""Generated parts that a page can ask for (training/studies/page_parts.py)."""


def report(
    folder: Path,
    config: dict[str, Any],
    cells: Sequence[SweepCell],
    searches: Sequence[Search],
    outcomes: Mapping[str, Outcome],
    study: Study,
    cost_estimate: Mapping[str, Any],
    *,
    images: Path | None = None,
    pages: Sequence[Path] = (),
) -> str:
    """Write tables, results.json and figures into the folder; returns the tables to print.

    cost_estimate: `cost.cost`. images: another folder for the figures, for documents. pages: Markdown
    files whose generated PARTS are written.
    """
    points, ranks = point_table(cells, outcomes), rank_correlation_table(cells, outcomes)
    worst = [
        {"controller": each.controller, "region": each.region, **outcomes[each.name]["result"]}
        for each in searches
    ]
    content = {
        "format": FORMAT,
        "configuration": config,
        "points": points.to_dict(orient="records"),
        "hypercube": ranks.to_dict(orient="records"),
        "worst": worst,
    }
    for name, table in {"points": points, "hypercube": ranks}.items():
        if len(table):
            write_text(folder / f"{name}.csv", table.to_csv(index=False))
    write_text(folder / "results.json", json.dumps(content, indent=1) + "\n")

    from training.studies.sweeps import sweep_figures as plots

    traces = [_trace(found, study) for found in worst]
    for place in filter(None, (folder, images)):
        plots.draw(points, ranks, place)
        if worst:
            plots.worst_episodes(worst, traces, study.plant.parameters, place / "robustness-worst.png")
    texts = {
        "joint": joint_table(points),
        "one at a time": harmful_changes_table(points),
        "worst": worst_table(worst, study.plant.parameters),
        "cost": cost_table(cost_estimate, MACHINES),
    }
    for page in pages:
        fill(page, texts)
    return "\n\n".join(texts.values())


def _trace(found: Mapping[str, Any], study: Study) -> Trace:
    """The worst episode that a search found, run once more."""
    each = {"scenario": [found["scenario"]], "parameters": [found["parameters"]]}
    _, trace = study.run(found["controller"], [found["seed"]], {}, each, trace_of=0)
    assert trace is not None  # since one was asked for
    return trace
