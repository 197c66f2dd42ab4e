"""The benchmark's figure: each training seed, the interquartile mean, and its interval."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from epv_env import MAX_EPISODE_STEPS
from training.evaluation.benchmark import FIGURES, Figure
from training.evaluation.plots import COLOURS, plt
from training.studies.benchmark.result_file import Entry
from training.studies.benchmark.score_table import Row, ranked

SHOWN = FIGURES[:3]
"""Figures with a column of panels each."""


def score_figure(entries: Sequence[Entry]) -> Picture:
    """A row of panels for each environment: points are runs, lines with ends the intervals."""
    tables = [rows for environment in MAX_EPISODE_STEPS if (rows := ranked(entries, environment))]
    heights = [len(rows) for rows in tables]
    picture, panels = plt.subplots(
        len(tables), len(SHOWN), figsize=(12, 1.5 + 0.3 * sum(heights)), layout="constrained",
        squeeze=False, sharey="row", sharex="col", gridspec_kw={"height_ratios": heights},
    )  # fmt: skip
    for rows, line in zip(tables, panels, strict=True):
        for axes, figure in zip(line, SHOWN, strict=True):
            _panel(axes, rows, figure)
        line[0].set_yticks(range(len(rows)), [row.entry.algorithm for row in rows], fontsize=9)
        line[0].set_ylim(len(rows) - 0.5, -0.5)
        line[0].set_ylabel(rows[0].entry.environment)
    for axes, figure in zip(panels[-1], SHOWN, strict=True):
        axes.set_xlabel(figure.heading)
        axes.set_xscale("symlog", linthresh=100.0) if figure is FIGURES[0] else None
    return picture


def _panel(axes: Axes, rows: Sequence[Row], figure: Figure) -> None:
    for place, row in enumerate(rows):
        colour = COLOURS[0] if row.entry.timesteps is not None else "0.4"
        found = row.estimates[figure.name]
        values = [figure.factor * getattr(run, figure.name) for run in row.entry.runs]
        axes.plot(values, [place] * len(values), ".", color=colour, alpha=0.5, ms=6)
        axes.plot([found.low, found.high], [place, place], "-", color=colour, lw=2)
        axes.plot(found.value, place, "D", color=colour, ms=5)
    axes.grid(alpha=0.3, axis="x")
