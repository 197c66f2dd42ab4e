"""The benchmark's table: interquartile means over training seeds, with intervals, beside references."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from training.evaluation.benchmark import FIGURES, Figure
from training.evaluation.statistics import Estimate, bootstrap_estimate
from training.studies.benchmark.result_file import Entry, Run
from training.studies.generated_pages import markdown


class Row(NamedTuple):
    """An entry with the estimate of each of FIGURES, by name."""

    entry: Entry
    estimates: dict[str, Estimate]


def estimate(runs: Sequence[Run], figure: Figure) -> Estimate:
    """A figure's interquartile mean over runs, and its 95 % interval; one run has no interval.

    The interval is a percentile bootstrap of the runs (Agarwal et al., NeurIPS 2021).
    """
    values = figure.factor * np.array([getattr(run, figure.name) for run in runs])
    return bootstrap_estimate(values[:, None, None])


def ranked(entries: Sequence[Entry], environment: str) -> list[Row]:
    """The environment's entries with their estimates, the best return first."""
    rows = [
        Row(entry, {figure.name: estimate(entry.runs, figure) for figure in FIGURES})
        for entry in entries
        if entry.environment == environment
    ]
    return sorted(rows, key=lambda row: -row.estimates[FIGURES[0].name].value)


def score_table(entries: Sequence[Entry], environment: str) -> str:
    """The environment's entries as Markdown."""
    headings = [
        "algorithm", "steps", "seeds", *(f.heading for f in FIGURES), "training [min]",
    ]  # fmt: skip
    return markdown(headings, [_cells(row) for row in ranked(entries, environment)])


def _cells(row: Row) -> list[str]:
    entry = row.entry
    trained = entry.timesteps is not None
    times = [run.cpu_s for run in entry.runs if run.cpu_s is not None]
    return [
        entry.algorithm if trained else f"*{entry.algorithm}*",
        f"{entry.timesteps:,}" if trained else "–",
        str(len(entry.runs)) if trained else "–",
        *(_figure(row.estimates[f.name], f, len(entry.runs)) for f in FIGURES),
        f"{np.mean(times) / 60:.1f}" if times else "–",
    ]


def _figure(found: Estimate, figure: Figure, runs: int) -> str:
    """A figure and, of several runs, its interval."""
    value, low, high = (format(x, figure.digits) for x in (found.value, found.low, found.high))
    return value if runs == 1 else f"{value} ({low} to {high})"
