"""What a sweep writes and prints: results.json, tables as CSV, figures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from epv_env.common.files import write_json, write_text
from training.evaluation.rollout import Trace
from training.studies.episode_tasks import Study
from training.studies.generated_pages import fill
from training.studies.parallel_run import Outcome
from training.studies.result_files import records
from training.studies.sweeps.computing_cost import SETTINGS as COST_SETTINGS
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
"""Generated parts that a page can ask for (training/studies/generated_pages.py)."""


@dataclass(frozen=True, kw_only=True)
class SweepResults:
    """What a finished sweep is reported from."""

    configuration: dict[str, Any]
    """Everything that the results depend on."""
    cells: Sequence[SweepCell]
    searches: Sequence[Search]
    outcomes: Mapping[str, Outcome]
    """By the name of a task."""
    study: Study
    cost_estimate: Mapping[str, Any]
    """As `computing_cost.cost` gives it."""

    @cached_property
    def points(self) -> pd.DataFrame:
        """A row for each point and controller."""
        return point_table(self.cells, self.outcomes)

    @cached_property
    def ranks(self) -> pd.DataFrame:
        """A row for each parameter of the Latin hypercube and controller."""
        return rank_correlation_table(self.cells, self.outcomes)

    @cached_property
    def worst(self) -> list[dict[str, Any]]:
        """The outcome of each worst-case search."""
        return [
            {"controller": each.controller, "region": each.region, **self.outcomes[each.name]["result"]}
            for each in self.searches
        ]


def report(
    results: SweepResults, folder: Path, *, images: Path | None = None, pages: Sequence[Path] = ()
) -> str:
    """Write tables, results.json and figures into the folder; returns the tables to print.

    Args:
        results: of the sweep.
        folder: where everything is written.
        images: another folder for copies of the figures, for documents.
        pages: Markdown files whose generated PARTS are written.
    """
    _write_tables(results, folder)
    _draw(results, [folder] if images is None else [folder, images])
    texts = {
        "joint": joint_table(results.points),
        "one at a time": harmful_changes_table(results.points),
        "worst": worst_table(results.worst, results.study.plant.parameters),
        "cost": cost_table(results.cost_estimate, COST_SETTINGS.machines),
    }
    for page in pages:
        fill(page, texts)
    return "\n\n".join(texts.values())


def _write_tables(results: SweepResults, folder: Path) -> None:
    """Write results.json, points.csv and hypercube.csv."""
    for name, table in {"points": results.points, "hypercube": results.ranks}.items():
        if len(table):
            write_text(folder / f"{name}.csv", table.to_csv(index=False))
    content = {
        "format": FORMAT,
        "configuration": results.configuration,
        "points": records(results.points),
        "hypercube": records(results.ranks),
        "worst": results.worst,
    }
    write_json(folder / "results.json", content)


def _draw(results: SweepResults, folders: Sequence[Path]) -> None:
    """Draw the figures into each folder."""
    from training.studies.sweeps import sweep_figures  # matplotlib takes a second to import: only now

    traces = [_trace(each, results.study) for each in results.worst]
    for folder in folders:
        sweep_figures.draw(results.points, results.ranks, folder)
        if results.worst:
            sweep_figures.worst_episodes(
                results.worst, traces, results.study.plant.parameters, folder / "robustness-worst.png"
            )


def _trace(worst: Mapping[str, Any], study: Study) -> Trace:
    """The worst episode that a search found, run once more."""
    each = {"scenario": [worst["scenario"]], "parameters": [worst["parameters"]]}
    _, trace = study.run(worst["controller"], [worst["seed"]], {}, each, trace_of=0)
    assert trace is not None  # since one was asked for
    return trace
