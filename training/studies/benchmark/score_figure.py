"""The benchmark's figure: each training seed, the interquartile mean, and its interval."""

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from epv_env import MAX_EPISODE_STEPS
from training.evaluation.benchmark import FIGURES, Figure
from training.evaluation.plots import COLOURS, plt
from training.studies.benchmark.result_file import Entry
from training.studies.benchmark.score_table import Row, ranked


class Panel(NamedTuple):
    """A figure in a column of panels; all are better further left."""

    figure: Figure
    label: str
    sign: float
    """Factor of the figure."""
    scale: str


PANELS = (
    Panel(FIGURES[0], "minus return", -1.0, "log"),
    Panel(FIGURES[1], FIGURES[1].heading, 1.0, "linear"),
    Panel(FIGURES[2], FIGURES[2].heading, 1.0, "log"),
)


def score_figure(entries: Sequence[Entry]) -> Picture:
    """A row of panels for each environment: points are runs, lines the intervals."""
    tables = [rows for environment in MAX_EPISODE_STEPS if (rows := ranked(entries, environment))]
    heights = [len(rows) for rows in tables]
    picture, axes = plt.subplots(
        len(tables), len(PANELS), figsize=(11, 1.5 + 0.28 * sum(heights)), layout="constrained",
        squeeze=False, sharey="row", sharex="col", gridspec_kw={"height_ratios": heights},
    )  # fmt: skip
    for rows, line in zip(tables, axes, strict=True):
        for each, panel in zip(line, PANELS, strict=True):
            _draw(each, rows, panel)
        line[0].set_yticks(range(len(rows)), [row.entry.algorithm for row in rows], fontsize=9)
        line[0].set_ylim(len(rows) - 0.5, -0.5)
        line[1].set_title(rows[0].entry.environment, fontsize=10)
    for each, panel in zip(axes[-1], PANELS, strict=True):
        each.set(xlabel=panel.label, xscale=panel.scale)
        if panel.scale == "log":  # whole numbers, few enough to stand side by side
            each.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            each.xaxis.set_major_formatter(StrMethodFormatter("{x:.0f}"))
            each.xaxis.set_minor_formatter(NullFormatter())
    return picture


def _draw(axes: Axes, rows: Sequence[Row], panel: Panel) -> None:
    for place, row in enumerate(rows):
        colour = COLOURS[0] if row.entry.timesteps is not None else "0.4"
        found = row.estimates[panel.figure.name]
        factor = panel.sign * panel.figure.factor
        values = [factor * getattr(run, panel.figure.name) for run in row.entry.runs]
        ends = [panel.sign * found.low, panel.sign * found.high]
        axes.plot(values, [place] * len(values), ".", color=colour, alpha=0.5, ms=6)
        axes.plot(ends, [place, place], "-", color=colour, lw=2)
        axes.plot(panel.sign * found.value, place, "D", color=colour, ms=5)
    axes.grid(alpha=0.3, axis="x")
