"""Figures of a sweep: violation rates and excursions, by what is changed."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from epv_env.reward import BAND_BAR
from training.evaluation.plots import COLOURS, plt, save_figure
from training.evaluation.rollout import Trace

WIDEST_BAR = 2.0
"""Right end of the excursion axes; what lies beyond is drawn at it, and is in points.csv."""

MARKERS = {"-10 %": "<", "+10 %": ">", "least": "|", "greatest": "|"}
"""Marker of each level of a parameter; the ends of its domain are drawn faintly."""


def draw(points: pd.DataFrame, ranks: pd.DataFrame, folder: Path) -> None:
    """The figures for which there are points."""
    if not len(points):
        return
    designs: dict[str, Callable[[pd.DataFrame, Path], None]] = {
        "parameters": parameters, "effects": effects, "conditions": conditions,
    }  # fmt: skip
    for name, figure in designs.items():
        if name in set(points["design"]):
            figure(points, folder / f"robustness-{name}.png")
    if len(ranks):
        hypercube(ranks, folder / "robustness-hypercube.png")


def _axes(rows: int) -> tuple[Any, Axes, Axes]:
    """A figure with a panel for the violation rate and one for the excursion."""
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(11, 1.4 + 0.3 * rows), sharey=True, layout="constrained"
    )
    left.set(
        xlabel="violation rate of ±500 mbar [%], exact 95 % intervals",
        xscale="symlog",
        xlim=(-0.1, 115),
    )
    left.set_xticks([0, 1, 3, 10, 30, 100], ["0", "1", "3", "10", "30", "100"])
    right.set(xlabel="excursion [bar]: median to worst", xlim=(0, 1.03 * WIDEST_BAR))
    right.axvline(BAND_BAR, color="0.4", ls="--", lw=0.9)
    for axis in (left, right):
        axis.grid(alpha=0.3, axis="x")
    return figure, left, right


def _dots(
    left: Axes, right: Axes, y: Any, rows: pd.DataFrame, marker: str, colour: str, **style: Any
) -> None:
    """Violation rate with its interval, and the excursion from median to worst."""
    share, low, high = (100 * rows[name] for name in ("left", "left_low", "left_high"))
    worst = np.minimum(rows["excursion_worst_bar"], WIDEST_BAR)
    bars = {"lw": 0.8, "alpha": 0.5 * style.get("alpha", 1.0), "color": colour}
    left.hlines(y, low, high, **bars)
    left.plot(share, y, marker, color=colour, ms=5, **style)
    right.hlines(y, np.minimum(rows["excursion_median_bar"], WIDEST_BAR), worst, **bars)
    right.plot(worst, y, marker, color=colour, ms=5, **style)


def _finish(
    figure: Any, left: Axes, labels: Sequence[str], controllers: Sequence[str], path: Path
) -> None:
    """Rows from the top, controllers by colour."""
    left.set_yticks(np.arange(len(labels)), labels, fontsize=8)
    left.set_ylim(len(labels) - 0.4, -0.6)
    handles = [Line2D([], [], color=c, marker="o", ls="") for c in COLOURS[: len(controllers)]]
    figure.legend(handles, controllers, fontsize=8, ncols=len(controllers), loc="outside upper center")
    save_figure(figure, path)


def _offsets(count: int) -> np.ndarray:
    """Where in a row each controller is drawn."""
    return (np.arange(count) - (count - 1) / 2) * min(0.25, 0.7 / count)


def parameters(points: pd.DataFrame, path: Path) -> None:
    """Each parameter at -10 % (<), +10 % (>), and at the ends of its domain (|); the worst on top."""
    table = points.loc[points["design"] == "parameters"]
    near: Any = table.loc[table["level"].isin(["-10 %", "+10 %"])]
    order = near.groupby("factor")["excursion_worst_bar"].max().sort_values(ascending=False).index
    controllers = list(dict.fromkeys(table["controller"]))
    figure, left, right = _axes(len(order))
    for name, colour, offset in zip(controllers, COLOURS, _offsets(len(controllers)), strict=False):
        rows = table.loc[table["controller"] == name].set_index("factor")
        for level, marker in MARKERS.items():
            at = rows.loc[rows["level"] == level].reindex(order)
            faint = {} if marker in "<>" else {"alpha": 0.45}
            _dots(left, right, np.arange(len(order)) + offset, at, marker, colour, **faint)
    left.set_title("◀ −10 %, ▶ +10 %, faint bar: ends of the expected domain", fontsize=8)
    _finish(figure, left, list(order), controllers, path)


def conditions(points: pd.DataFrame, path: Path) -> None:
    """Regions and conditions, a row for each level."""
    table = points.loc[points["design"].isin(["regions", "conditions"])]
    rows = list(dict.fromkeys(zip(table["factor"], table["level"], strict=True)))
    controllers = list(dict.fromkeys(table["controller"]))
    figure, left, right = _axes(len(rows))
    for name, colour, offset in zip(controllers, COLOURS, _offsets(len(controllers)), strict=False):
        mine = table.loc[table["controller"] == name]
        _dots(left, right, np.arange(len(rows)) + offset, mine, "o", colour)
    _finish(figure, left, [f"{factor}: {level}" for factor, level in rows], controllers, path)


def effects(points: pd.DataFrame, path: Path) -> None:
    """Worst excursion as colour, violation rate as number, effect by size, for each controller."""
    table = points.loc[points["design"] == "effects"]
    controllers = list(dict.fromkeys(table["controller"]))
    names, levels = list(dict.fromkeys(table["factor"])), list(dict.fromkeys(table["level"]))
    figure, axes = plt.subplots(
        1, len(controllers), figsize=(3.6 + 2.2 * len(controllers), 1.6 + 0.24 * len(names)),
        sharey=True, layout="constrained", squeeze=False,
    )  # fmt: skip
    image = None
    for axis, controller in zip(axes[0], controllers, strict=True):
        mine: Any = table.loc[table["controller"] == controller].set_index(["factor", "level"])
        shares, excursions = mine["left"].to_dict(), mine["excursion_worst_bar"].to_dict()
        grid = np.array([[excursions[name, level] for level in levels] for name in names])
        image = axis.imshow(grid, cmap="RdBu_r", vmin=0.0, vmax=2 * BAND_BAR, aspect="auto")
        for (row, column), _ in np.ndenumerate(grid):
            share = 100 * shares[names[row], levels[column]]
            dark = abs(min(grid[row, column], 2 * BAND_BAR) - BAND_BAR) > 0.7 * BAND_BAR
            axis.text(
                column, row, f"{share:.3g}", ha="center", va="center", fontsize=7,
                color="white" if dark else "black",
            )  # fmt: skip
        axis.set_xticks(np.arange(len(levels)), levels, fontsize=8)
        axis.set_title(controller, fontsize=9)
    axes[0, 0].set_yticks(np.arange(len(names)), names, fontsize=8)
    if image is not None:
        figure.colorbar(image, ax=axes, label="worst excursion [bar]", extend="max")
    figure.suptitle("Effects alone: number = violation rate of ±500 mbar [%]", fontsize=10)
    save_figure(figure, path)


def hypercube(ranks: pd.DataFrame, path: Path) -> None:
    """How the excursion goes with each parameter over the Latin hypercube."""
    table: Any = ranks.pivot(index="symbol", columns="controller", values="rank_correlation")
    table = table[list(dict.fromkeys(ranks["controller"]))]
    table = table.loc[table.abs().max(axis=1).sort_values(ascending=False).index]
    figure, axis = plt.subplots(figsize=(7, 1.2 + 0.3 * len(table)), layout="constrained")
    for name, colour, offset in zip(table, COLOURS, _offsets(table.shape[1]), strict=False):
        y = np.arange(len(table)) + offset
        axis.hlines(y, 0, table[name], color=colour, lw=1.0, alpha=0.5)
        axis.plot(table[name], y, "o", color=colour, ms=5, label=name)
    axis.axvline(0, color="0.4", lw=0.8)
    axis.set_yticks(np.arange(len(table)), table.index)
    axis.set(xlabel="rank correlation of parameter and excursion", ylim=(len(table) - 0.4, -0.6))
    axis.grid(alpha=0.3, axis="x")
    figure.legend(fontsize=8, ncols=table.shape[1], loc="outside upper center")
    save_figure(figure, path)


def worst_episodes(
    worst: Sequence[Mapping[str, Any]],
    traces: Sequence[Trace],
    nominal: Mapping[str, float],
    path: Path,
) -> None:
    """The worst episode that of each search: p2, the coil, what is drawn; the plant in its title."""
    regions = list(dict.fromkeys(each["region"] for each in worst))
    controllers = list(dict.fromkeys(each["controller"] for each in worst))
    figure = plt.figure(figsize=(6.2 * len(controllers), 4.4 * len(regions)), layout="constrained")
    panels = figure.subfigures(len(regions), len(controllers), squeeze=False)
    for each, trace in zip(worst, traces, strict=True):
        panel = panels[regions.index(each["region"]), controllers.index(each["controller"])]
        axes = panel.subplots(3, 1, sharex=True, height_ratios=[4, 0.6, 1])
        axes[0].axhspan(-BAND_BAR, BAND_BAR, color="0.92")
        axes[0].plot(trace.time, trace.p2_bar - trace.target_bar, lw=1.0)
        axes[0].set_ylim(bottom=max(float(np.min(trace.p2_bar)) - trace.target_bar, -3.0) - 0.1)
        axes[0].set_ylabel("p2 − target [bar]")
        axes[1].step(trace.time, trace.coil, where="pre", lw=0.6)
        axes[1].set(ylim=(-0.15, 1.15), yticks=[0, 1], ylabel="coil")
        axes[2].plot(trace.time, trace.consumption_g_per_s, color="0.3")
        axes[2].set(xlabel="time [s]", ylabel="drawn\n[g/s]")
        panel.suptitle(_title(each, nominal), fontsize=8)
    save_figure(figure, path)


def _title(worst: Mapping[str, Any], nominal: Mapping[str, float]) -> str:
    """Controller, region, excursion, and how far each parameter is off, in lines of five."""
    off = [
        f"{symbol} {100 * (value / nominal[symbol] - 1):+.2g} %"
        for symbol, value in worst["parameters"].items()
    ]
    lines = [", ".join(off[k : k + 5]) for k in range(0, len(off), 5)]
    head = f"{worst['controller']}, {worst['region']}: {worst['excursion_bar']:.3f} bar"
    return "\n".join([f"{head} ({worst['scenario']}, seed {worst['seed']})", *lines])
