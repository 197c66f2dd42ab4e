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


WORDS = {
    "region": "plants",
    "calibrated": "the plant itself",
    "exact": "the plant itself",
    "confidence": "its confidence region",
    "ten_percent": "4 parameters ±10 %",
    "sensitive_ten_percent": "13 parameters ±10 %",
}
"""What people read instead of the names of plant sets."""


def in_words(name: str) -> str:
    """A plant set, an effect or another factor as people read it."""
    return WORDS.get(name, name.replace("_", " "))


def episode_overlay(traces: dict[str, Trace], own: str, path: Path) -> None:
    """The same episode under several controllers: circuit pressure, coil and consumption.

    own: label of the controller that stands out, and whose coil is drawn; the others are faint.
    """
    figure, (pressure, coil, drawn) = plt.subplots(
        3, 1, figsize=(7.2, 5), sharex=True, layout="constrained", height_ratios=[4, 1, 1]
    )
    mine = traces[own]
    target = mine.target_bar
    pressure.axhspan(target - BAND_BAR, target + BAND_BAR, color="0.94", label="target ±500 mbar")
    others = {label: trace for label, trace in traces.items() if label != own}
    for (label, trace), line in zip(others.items(), ("--", ":", "-."), strict=False):
        pressure.plot(trace.time, trace.p2_bar, line, color="0.6", lw=1.2, label=label)
    pressure.plot(mine.time, mine.p2_bar, color=COLOURS[0], lw=2, label=own)
    pressure.set_ylabel("circuit pressure\n[bar absolute]")
    coil.step(mine.time, mine.coil, where="pre", color=COLOURS[0], lw=1)
    coil.set(ylim=(-0.15, 1.15), yticks=[0, 1], yticklabels=["valve open", "shut"])
    coil.set_title(f"coil under {own}", loc="left", fontsize=10)
    drawn.plot(mine.time, mine.consumption_g_per_s, color="0.3")
    drawn.set_title("air that the brakes draw [g/s]", loc="left", fontsize=10)
    drawn.set_xlabel("time [s]")
    figure.legend(
        *pressure.get_legend_handles_labels(), ncols=2, loc="outside upper center", frameon=False
    )
    save_figure(figure, path)
