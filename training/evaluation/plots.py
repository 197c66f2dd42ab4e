"""Pictures without a display: writing one, and an episode under several controllers."""

import io
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from epv_env.common.files import write_bytes
from epv_env.reward import BAND_BAR
from training.evaluation.rollout import Trace

COLOURS = tuple(plt.rcParams["axes.prop_cycle"].by_key()["color"])
"""Of controllers, in their order."""


def save_figure(figure: Figure, path: Path) -> None:
    """Write a PNG, whole or not at all, and free the figure."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=130, bbox_inches="tight")
    write_bytes(path, stream.getvalue())
    plt.close(figure)


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
        ncols=min(rows + 1, 4),
        loc="outside upper center",
    )
    axes[-1].plot(first.time, first.consumption_g_per_s, color="0.3")
    axes[-1].set_ylabel("consumption\n[g/s]", rotation=0, ha="right", va="center", fontsize=8)
    axes[-1].set_xlabel("time [s]     (coil: 1 on, valve shuts; 0 off, valve opens; PWM: duty)")
    save_figure(figure, path)
