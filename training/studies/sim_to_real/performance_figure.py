"""The picture of the sim-to-real loop: simulated against measured, before and after."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from training.evaluation.plots import COLOURS, plt
from training.studies.sim_to_real.deployment import AFTER, BEFORE, MEASURED, SIMULATED
from training.studies.sim_to_real.performance_tables import ENDS, interval_column

PANELS = {
    "C1_stayed": ("C1: episodes that stay\nwithin ±500 mbar [%]", 100.0),
    "C1_worst_excursion_bar": ("C1: worst |p2 - target|\nof all episodes [bar]", 1.0),
    "C2_mean_breakdown_bar": ("C2: largest breakdown\nof an episode, mean [bar]", 1.0),
    "C3_stayed": ("C3: episodes that stay, plants\nwithin ±10 % [%]", 100.0),
}
"""Label and factor of each panel, by its column in `figures`."""

STAGES = {BEFORE: "before:\nnominal plant", AFTER: "after:\ncorrected plant"}
MARKERS = {SIMULATED: "o", MEASURED: "s"}
SIDES = {SIMULATED: -0.2, MEASURED: 0.2}
"""Distance from a controller's place, in distances between controllers [1]."""
WIDTH = 0.8
"""Of the controllers of a stage together on the x-axis; the stages are 1 apart."""


def performance_figure(aims: pd.DataFrame) -> Figure:
    """Open circles: simulated; full squares: measured on the bench's valve.

    aims: rows of `performance_table`. The line between the two is the gap; bars are 95 % intervals.
    """
    figure, panels = plt.subplots(1, len(PANELS), figsize=(13, 4.2), layout="constrained")
    names = list(dict.fromkeys(aims["controller"]))
    apart = WIDTH / len(names)
    for axes, (column, (label, factor)) in zip(panels, PANELS.items(), strict=True):
        for k, name in enumerate(names):
            own = aims.loc[aims["controller"] == name]
            places = {place: (k - (len(names) - 1) / 2 + side) * apart for place, side in SIDES.items()}
            _draw(axes, own, column, factor, places, COLOURS[k])
        axes.set(ylabel=label, xlim=(-0.5, 1.5), xticks=[0, 1], xticklabels=STAGES.values())
        axes.set_ylim(bottom=None if factor > 1 else 0.0)
        axes.grid(alpha=0.3, axis="y")
    handles = [Line2D([], [], color=c, lw=3, label=n) for n, c in zip(names, COLOURS, strict=False)]
    handles += [
        Line2D([], [], color="0.2", ls="", marker="o", mfc="white", label="simulated"),
        Line2D([], [], color="0.2", ls="", marker="s", label="measured (bench)"),
    ]
    figure.legend(handles=handles, fontsize=9, ncols=len(handles), loc="outside upper center")
    return figure


def _draw(
    axes: Axes,
    rows: pd.DataFrame,
    column: str,
    factor: float,
    offsets: dict[str, float],
    colour: str,
) -> None:
    """One controller's points, simulated and measured, before and after."""
    rows = rows.set_index(["stage", "place"])
    for x, stage in enumerate(STAGES):
        places = {place: x + offset for place, offset in offsets.items()}
        values = {place: factor * rows.loc[(stage, place), column] for place in places}
        axes.plot(list(places.values()), list(values.values()), color=colour, lw=1.2, alpha=0.7)
        for place, at in places.items():
            row, value = rows.loc[(stage, place)], values[place]
            ends = factor * np.array([row.get(interval_column(column, e), value / factor) for e in ENDS])
            axes.errorbar(
                at, value, yerr=np.abs(ends - value)[:, None], fmt=MARKERS[place], color=colour,
                mfc="white" if place == SIMULATED else colour, ms=6, capsize=2, lw=1.0,
            )  # fmt: skip
