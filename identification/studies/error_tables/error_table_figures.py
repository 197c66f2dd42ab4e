"""Pictures of the ranking."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification.recordings.recording import OUTPUTS
from identification.studies.error_tables.bench_conditions import CASES
from identification.studies.error_tables.patterns import printed_after
from identification.studies.error_tables.ranking import (
    CANNOT,
    CURRENT,
    GIVES,
    PRESSURES,
    TOLERANCE,
    Match,
)
from identification.studies.error_tables.results import Study

COLOURS = {GIVES: "tab:green", CURRENT: "tab:blue", PRESSURES: "tab:orange", CANNOT: "0.55"}
SHOWN, PAIRS = 20, 8
"""Causes and pairs that are drawn."""
LINES = ("-", "--", ":")


def ranking(study: Study) -> Figure:
    """Left: how far causes and pairs are from the tables. Right: some of their errors, by test."""
    figure = Figure(figsize=(11, 8.5), layout="constrained")
    grid = figure.add_gridspec(len(OUTPUTS), 2, width_ratios=[1, 1.1])
    pairs = study.checked[:PAIRS]
    left = figure.add_subplot(grid[:, 0])
    _factors(left, [*pairs, *study.singles[:SHOWN]], len(pairs))
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=len(COLOURS) + 1)
    for row, output in enumerate(OUTPUTS):
        axes = figure.add_subplot(grid[row, 1])
        _errors(axes, row, _shown(study))
        axes.set_ylabel(f"error of {output} [%]")
    return figure


def _factors(axes: Axes, found: list[Match], n_pairs: int) -> None:
    rows = np.arange(len(found))
    for row, match in zip(rows, found, strict=True):
        low, high = match.interval
        colour = COLOURS[match.verdict]
        axes.hlines(row, low, high, color=colour, linewidth=3, alpha=0.5)
        axes.plot(match.median, row, "o", color=colour, markersize=5)
    for verdict, colour in COLOURS.items():
        axes.plot([], [], "o", color=colour, label=verdict)
    axes.axvline(TOLERANCE, color="tab:red", linestyle="--", linewidth=1, label=f"factor {TOLERANCE:g}")
    axes.axhline(n_pairs - 0.5, color="black", linewidth=0.6)
    axes.set_xscale("log")
    axes.set_xticks([1, 1.5, 2, 3, 5, 10], ["1", "1.5", "2", "3", "5", "10"], minor=False)
    axes.set_xticks([], minor=True)
    axes.set_xlabel("typical factor between predicted and printed errors")
    axes.set_yticks(rows, [match.cause.replace("parameter:", "") for match in found], fontsize=8)
    axes.invert_yaxis()
    axes.grid(axis="x", alpha=0.3)


def _errors(axes: Axes, output: int, shown: list[Match]) -> None:
    tests = range(len(CASES))
    for match, line in zip(shown, LINES, strict=False):
        label = match.cause.replace("parameter:", "")
        axes.plot(tests, match.predicted[:, output], line, marker=".", label=label)
    axes.plot(tests, printed_after()[:, output], "D", color="black", label="printed (Tables 13, 15)")
    axes.set_ylim(0.0, (1.7 if output == 0 else 1.1) * axes.get_ylim()[1])
    if output == 0:
        axes.legend(loc="upper left", fontsize="x-small")
    axes.set_xticks(tests, [case.name for case in CASES])
    axes.grid(alpha=0.3)


def _shown(study: Study) -> list[Match]:
    """The nearest pair, the nearest one without a cause of that pair, and the nearest single cause."""
    first = study.checked[0]
    names = set(first.cause.split(" + "))
    others = [match for match in study.checked if not names & set(match.cause.split(" + "))]
    return [first, *others[:1], study.singles[0]]
