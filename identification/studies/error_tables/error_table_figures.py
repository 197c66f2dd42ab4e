"""Pictures of the ranking."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification.recordings.recording import OUTPUTS
from identification.studies.error_tables.bench_conditions import CASES
from identification.studies.error_tables.error_prediction import printed_calibrated_errors
from identification.studies.error_tables.ranking import (
    EXPLAINS_ALL,
    EXPLAINS_CURRENT,
    EXPLAINS_NOTHING,
    EXPLAINS_PRESSURES,
    CauseMatch,
)
from identification.studies.error_tables.results import ErrorTableResults

COLOURS = {
    EXPLAINS_ALL: "tab:green",
    EXPLAINS_CURRENT: "tab:blue",
    EXPLAINS_PRESSURES: "tab:orange",
    EXPLAINS_NOTHING: "0.55",
}
SHOWN_CAUSES, SHOWN_PAIRS = 20, 8
"""Single causes and pairs that the left panel shows."""
LINE_STYLES = ("-", "--", ":")


def ranking_figure(results: ErrorTableResults) -> Figure:
    """Left: typical factors of causes and pairs. Right: the errors of some of them, by test."""
    figure = Figure(figsize=(11, 8.5), layout="constrained")
    grid = figure.add_gridspec(len(OUTPUTS), 2, width_ratios=[1, 1.1])
    pairs = results.pairs[:SHOWN_PAIRS]
    left = figure.add_subplot(grid[:, 0])
    matches = [*pairs, *results.singles[:SHOWN_CAUSES]]
    _draw_factors(left, matches, len(pairs), results.settings.tolerance)
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=len(COLOURS) + 1)
    for row, output in enumerate(OUTPUTS):
        axes = figure.add_subplot(grid[row, 1])
        _draw_errors(axes, row, _contrasting_matches(results))
        axes.set_ylabel(f"error of {output} [%]")
    return figure


def _draw_factors(axes: Axes, matches: list[CauseMatch], n_pairs: int, tolerance: float) -> None:
    rows = np.arange(len(matches))
    for row, match in zip(rows, matches, strict=True):
        low, high = match.interval
        colour = COLOURS[match.verdict]
        axes.hlines(row, low, high, color=colour, linewidth=3, alpha=0.5)
        axes.plot(match.median, row, "o", color=colour, markersize=5)
    for verdict, colour in COLOURS.items():
        axes.plot([], [], "o", color=colour, label=verdict)
    axes.axvline(tolerance, color="tab:red", linestyle="--", linewidth=1, label=f"factor {tolerance:g}")
    axes.axhline(n_pairs - 0.5, color="black", linewidth=0.6)
    axes.set_xscale("log")
    axes.set_xticks([1, 1.5, 2, 3, 5, 10], ["1", "1.5", "2", "3", "5", "10"], minor=False)
    axes.set_xticks([], minor=True)
    axes.set_xlabel("typical factor between predicted and printed errors")
    axes.set_yticks(rows, [match.cause.replace("parameter:", "") for match in matches], fontsize=8)
    axes.invert_yaxis()
    axes.grid(axis="x", alpha=0.3)


def _draw_errors(axes: Axes, output: int, matches: list[CauseMatch]) -> None:
    tests = range(len(CASES))
    printed = printed_calibrated_errors()[:, output]
    for match, style in zip(matches, LINE_STYLES, strict=False):
        label = match.cause.replace("parameter:", "")
        axes.plot(tests, match.predicted[:, output], style, marker=".", label=label)
    axes.plot(tests, printed, "D", color="black", label="printed (Tables 13, 15)")
    axes.set_ylim(0.0, (1.7 if output == 0 else 1.1) * axes.get_ylim()[1])
    if output == 0:
        axes.legend(loc="upper left", fontsize="x-small")
    axes.set_xticks(tests, [case.name for case in CASES])
    axes.grid(alpha=0.3)


def _contrasting_matches(results: ErrorTableResults) -> list[CauseMatch]:
    """The nearest pair, the nearest pair that shares no cause with it, and the nearest single cause."""
    first = results.pairs[0]
    names = set(first.cause.split(" + "))
    others = [match for match in results.pairs if not names & set(match.cause.split(" + "))]
    return [first, *others[:1], results.singles[0]]
