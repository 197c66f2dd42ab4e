"""Figures of a training run, drawn without a display."""

import io
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from cycler import cycler
from matplotlib.figure import Figure

from epv_env.common.files import write_bytes
from epv_env.reward import BAND_BAR
from training.evaluation.controller_table import Comparison
from training.evaluation.rollout import Trace

COLOURS = (
    *plt.rcParams["axes.prop_cycle"].by_key()["color"],
    "black",
    "navy",
    "darkgoldenrod",
    "deeppink",
    "turquoise",
    "lawngreen",
    "indigo",
)
"""Of lines and dots: as many as there are controllers to compare."""
plt.rcParams["axes.prop_cycle"] = cycler(color=COLOURS)

LEGEND_COLUMNS = 6
"""Most entries of a legend side by side: more would widen the figure."""


WIDEST_BAR = 1.2
"""Right end of the excursion axis; the table holds what lies beyond."""


def save_figure(figure: Figure, path: Path) -> None:
    """Write a PNG, whole or not at all, and free the figure."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=130, bbox_inches="tight")
    write_bytes(path, stream.getvalue())
    plt.close(figure)


def learning_curve(rows: list[dict[str, float]], path: Path) -> None:
    """Return and success rate over environment steps."""
    steps = np.array([row["timesteps"] for row in rows]) / 1e6
    figure, (top, bottom) = plt.subplots(2, 1, figsize=(7, 5), sharex=True)
    top.plot(steps, [row["episode_return"] for row in rows])
    top.set_ylabel("return of an episode")
    bottom.plot(steps, [100 * row["success_rate"] for row in rows], color=COLOURS[2])
    bottom.set_ylabel("episodes inside ±500 mbar\nafter settling [%]")
    bottom.set_xlabel("environment steps [millions]")
    bottom.set_ylim(-2, 102)
    for axes in (top, bottom):
        axes.grid(alpha=0.3)
    figure.suptitle("PPO learning curve (exploring policy)")
    save_figure(figure, path)


def episode_overlay(traces: dict[str, Trace], path: Path) -> None:
    """The same episode under every controller: circuit pressure, coil and consumption."""
    rows = len(traces)
    figure, axes = plt.subplots(
        rows + 2, 1, figsize=(9, 4.2 + 0.65 * rows), sharex=True, layout="constrained",
        height_ratios=[4, *([0.6] * rows), 1],
    )  # fmt: skip
    first = next(iter(traces.values()))
    target = first.target_bar
    axes[0].axhspan(target - BAND_BAR, target + BAND_BAR, color="0.92", label="target ±500 mbar")
    axes[0].axhline(target, color="0.5", lw=0.8)
    for (name, trace), colour, coil in zip(traces.items(), COLOURS, axes[1:-1], strict=False):
        axes[0].plot(trace.time, trace.p2_bar, color=colour, lw=1.1, label=name)
        coil.step(trace.time, trace.coil, where="pre", color=colour, lw=0.8)
        coil.set(ylim=(-0.15, 1.15), yticks=[0, 1])
        coil.set_ylabel(
            f"coil, {name}".replace(", ", "\n"), rotation=0, ha="right", va="center", fontsize=8
        )
    axes[0].set_ylabel("circuit pressure p2\n[bar absolute]")
    figure.legend(
        *axes[0].get_legend_handles_labels(),
        fontsize=8,
        ncols=min(rows + 1, LEGEND_COLUMNS),
        loc="outside upper center",
    )
    axes[-1].plot(first.time, first.consumption_g_per_s, color="0.3")
    axes[-1].set_ylabel("consumption\n[g/s]", rotation=0, ha="right", va="center", fontsize=8)
    axes[-1].set_xlabel("time [s]     (coil: 1 on, valve shuts; 0 off, valve opens; PWM: duty)")
    save_figure(figure, path)


def excursion_distribution(comparison: Comparison, path: Path) -> None:
    """Share of episodes whose worst excursion is larger than x, by plant set."""
    sets = list(dict.fromkeys(plants for plants, _ in comparison.metrics))
    figure, axes = plt.subplots(
        1, len(sets), figsize=(4 * len(sets), 3.8), sharex=True, sharey=True, layout="constrained"
    )
    for axis, plants in zip(np.atleast_1d(axes), sets, strict=True):
        for (where, name), metrics in comparison.metrics.items():
            if where == plants:
                worst = np.sort(metrics.excursion_bar)
                beyond = 1 - np.arange(len(worst)) / len(worst)
                axis.step(worst, 100 * beyond, where="pre", label=name)
        axis.axvline(BAND_BAR, color="0.4", ls="--", lw=0.9)
        axis.set(yscale="log", title=plants, xlabel="worst |p2 - target| after settling [bar]")
        axis.set_xlim(0.0, WIDEST_BAR)
        axis.grid(alpha=0.3, which="both")
    np.atleast_1d(axes)[0].set_ylabel("episodes with a larger excursion [%]")
    handles = np.atleast_1d(axes)[0].get_legend_handles_labels()
    figure.legend(
        *handles, fontsize=8, ncols=min(len(handles[0]), LEGEND_COLUMNS), loc="outside upper center"
    )
    save_figure(figure, path)
