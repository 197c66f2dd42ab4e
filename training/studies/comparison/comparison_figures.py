"""The comparison's figures. Each takes tables of score_tables.py and gives a Figure."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

from epv_env.reward import BAND_BAR, RewardWeights
from training.evaluation.plots import COLOURS, LEGEND_COLUMNS, plt
from training.studies.comparison.score_tables import FRONT, HIGHER_IS_BETTER, JUDGED_ON, SCORES
from training.studies.result_files import records

HIGHEST_BAR = 1.0
"""Top of the trade-off's pressure axes; points above it are in its table."""

HEAT_MAPS = {
    "C1_left": ("violation rate of ±500 mbar [%]", 100.0, ".0f"),
    "rms_error_bar": ("rms error [mbar]", 1e3, ".0f"),
}
"""Label, factor and format of each heat map."""


def scenario_maps(rows: pd.DataFrame, plants: str) -> Figure:
    """A cell per scenario and controller: the violation rate, and the rms error."""
    rows = rows.loc[rows["plants"] == plants].assign(C1_left=lambda r: 1 - r["C1_stayed"])
    names, scenarios = rows["controller"].unique(), rows["scenario"].unique()
    size = (13, 3.0 + 0.33 * len(scenarios))  # the names stand upright below
    figure, panels = plt.subplots(1, len(HEAT_MAPS), figsize=size, layout="constrained", sharey=True)
    for axes, (column, (label, factor, spec)) in zip(panels, HEAT_MAPS.items(), strict=True):
        cells = factor * rows.pivot(index="scenario", columns="controller", values=column)
        cells = cells.loc[scenarios, names]
        top = max(float(np.nanquantile(cells, 0.8)), 1e-9)  # one bad controller must not bleach the rest
        axes.imshow(cells, cmap="YlOrRd", vmin=0.0, vmax=top, aspect="auto")
        for (i, j), value in np.ndenumerate(cells.to_numpy()):
            axes.text(j, i, format(value, spec), ha="center", va="center", fontsize=8,
                      color="white" if value > 0.7 * top else "black")  # fmt: skip
        axes.set_xticks(range(len(names)), [str(n) for n in names], fontsize=8, rotation=90)
        axes.set_yticks(range(len(scenarios)), scenarios)
        axes.set_title(f"{label}; {plants}", fontsize=10)
    return figure


def aggregate(means: pd.DataFrame) -> Figure:
    """Interquartile means with their intervals: a panel per score and plant set."""
    names = list(means["controller"].unique())
    figure, panels = plt.subplots(
        len(JUDGED_ON), len(SCORES), figsize=(14, 2.2 + 0.5 * len(names)), sharex="col", sharey=True,
        layout="constrained",
    )  # fmt: skip
    for row, plants in zip(np.atleast_2d(panels), JUDGED_ON, strict=True):
        for axes, (score, label) in zip(row, SCORES.items(), strict=True):
            own = means.loc[(means["plants"] == plants) & (means["score"] == score)]
            for k, name in enumerate(names):
                row_of_name = records(own.loc[own["controller"] == name])[0]
                _interval(axes, k, row_of_name, "value", COLOURS[k % len(COLOURS)])
            better = "higher" if score in HIGHER_IS_BETTER else "lower"
            axes.set_xlabel(f"{label}\n({better} is better)", fontsize=8)
            axes.grid(alpha=0.3, axis="x")
        row[0].set_yticks(range(len(names)), names, fontsize=8)
        row[0].set_ylabel(plants)
    figure.axes[0].set_ylim(len(names) - 0.5, -0.5)
    figure.suptitle("Interquartile mean over scenarios and seeds, 95 % bootstrap interval", fontsize=10)
    return figure


def _interval(axes: Axes, y: float, row: dict[str, Any], name: str, colour: str) -> None:
    """A point with its interval, from the columns NAME, NAME_low and NAME_high."""
    value = row[name]
    ends = [[max(value - row[f"{name}_low"], 0.0)], [max(row[f"{name}_high"] - value, 0.0)]]
    axes.errorbar(value, y, xerr=ends, fmt="o", ms=4, capsize=3, color=colour)


def paired_comparison_figure(table: pd.DataFrame, ours: str) -> Figure:
    """Probability that ours is the better one in an episode both meet, and the paired differences."""
    shown = [score for score in SCORES if score != "episode_return"]
    rivals = list(table["rival"].unique())
    size = (14, 1.6 + 0.4 * len(rivals))
    figure, panels = plt.subplots(1, len(shown) + 1, figsize=size, sharey=True, layout="constrained")
    shifts = np.linspace(-0.15, 0.15, len(JUDGED_ON))
    for plants, shift, colour in zip(JUDGED_ON, shifts, COLOURS, strict=False):
        own = {(r["rival"], r["score"]): r for r in records(table) if r["plants"] == plants}
        for k, rival in enumerate(rivals):
            for axes, score in zip(panels, shown, strict=False):
                _interval(axes, k + shift, own[rival, score], "difference", colour)
            _interval(panels[-1], k + shift, own[rival, "episode_return"], "better", colour)
        panels[0].plot([], [], "o", color=colour, label=plants)
    for axes, score in zip(panels, shown, strict=False):
        axes.axvline(0.0, color="0.4", lw=0.9)
        axes.set_xlabel(f"{ours} minus rival:\n{SCORES[score]}", fontsize=8)
    panels[-1].axvline(0.5, color="0.4", lw=0.9)
    panels[-1].set_xlabel(f"probability that {ours}\nhas the better return", fontsize=8)
    panels[-1].set_xlim(-0.05, 1.05)
    panels[0].set_yticks(range(len(rivals)), rivals, fontsize=8)
    panels[0].set_ylim(len(rivals) - 0.5, -0.5)
    for axes in panels:
        axes.grid(alpha=0.3, axis="x")
    figure.legend(fontsize=8, ncols=2, loc="outside upper center")
    return figure


def trade_off_figure(traded: pd.DataFrame) -> Figure:
    """Excursion, breakdown and rms error over switchings; the line is the Pareto front.

    Small numbers: prices of switching that are not the reward's. What lies above a panel is named there.
    """
    figure, panels = plt.subplots(1, len(FRONT), figsize=(12, 3.8), layout="constrained")
    for axes, (column, label) in zip(panels, FRONT.items(), strict=True):
        for name, rows in traded.groupby("controller", sort=False):
            axes.plot(rows["switchings_per_s"], rows[column], "o", label=name)
        for row in records(traded.loc[traded["switching_price"] != RewardWeights().switching]):
            axes.annotate(
                f"{row['switching_price']:g}", (row["switchings_per_s"], row[column]),
                xytext=(4, 4), textcoords="offset points", fontsize=7, color="0.4",
            )  # fmt: skip
        front = traded.loc[traded[f"{column}_on_front"]].sort_values("switchings_per_s")
        axes.step(front["switchings_per_s"], front[column], where="post", color="0.5", lw=0.9, zorder=0)
        if column.startswith("C"):
            axes.axhline(BAND_BAR, color="0.4", ls="--", lw=0.9)
        axes.set(xlabel="coil switchings [1/s]", ylabel=label, xscale="log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(ScalarFormatter())
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_ylim(0, HIGHEST_BAR)
        beyond = traded.loc[traded[column] > HIGHEST_BAR, "controller"].unique()
        axes.set_title(f"above: {', '.join(beyond)}" if len(beyond) else "", fontsize=8)
        axes.grid(alpha=0.3, which="both")
    handles = panels[0].get_legend_handles_labels()
    figure.legend(
        *handles, fontsize=8, ncols=min(len(handles[0]), LEGEND_COLUMNS), loc="outside upper center"
    )
    return figure


def learning_curves(curves: Mapping[str, pd.DataFrame]) -> Figure:
    """Return and success rate over environment steps, a line per training seed."""
    figure, (top, bottom) = plt.subplots(2, 1, figsize=(7, 5), sharex=True, layout="constrained")
    for name, curve in curves.items():
        steps = curve["timesteps"] / 1e6
        top.plot(steps, curve["episode_return"], lw=0.9, label=name)
        bottom.plot(steps, 100 * curve["success_rate"], lw=0.9)
    top.set_ylabel("return of an episode\n(exploring)")
    bottom.set_ylabel("episodes inside ±500 mbar\nafter settling [%]")
    bottom.set(xlabel="environment steps [millions]", ylim=(-2, 102))
    for axes in (top, bottom):
        axes.grid(alpha=0.3)
    figure.legend(fontsize=7, ncols=5, loc="outside upper center")
    return figure
