"""Repetitions of a splitting as a probability with its interval, and a picture of the rare episodes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from training.evaluation.plots import plt
from training.rare.splitting import interval

SHOWN, FLOWS = 40, 3
"""Most rare episodes of a picture, and of its panel of consumptions, where lines cover each other."""


def tail(thresholds: Sequence[float], repetitions: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """How rarely each threshold is exceeded: excursion_bar, probability, low, high (95 %)."""
    estimates = np.cumprod([each["shares"] for each in repetitions], axis=1)
    ends = [interval(column) for column in estimates.T]
    return pd.DataFrame(
        {
            "excursion_bar": thresholds, "probability": estimates.mean(axis=0),
            "low": [low for low, _ in ends], "high": [high for _, high in ends],
        }
    )  # fmt: skip


def plain_episodes(repetitions: Sequence[dict[str, Any]]) -> float:
    """Episodes with which plain simulation would know the last probability as well; infinite for 0."""
    estimates = np.prod([each["shares"] for each in repetitions], axis=1)
    p, variance = float(estimates.mean()), float(np.var(estimates, ddof=1)) / len(estimates)
    return p * (1 - p) / variance if p > 0 and variance > 0 else np.inf


def rare_figure(episodes: Sequence[dict[str, Any]], duration: float) -> Figure:
    """Parameters, first pressures and consumption of rare episodes, some of them drawn.

    duration: of an episode [s].
    """
    drawn, (plants, pressures, flows) = plt.subplots(
        1, 3, figsize=(11, 4), layout="constrained", width_ratios=[3, 2, 4]
    )
    shown = episodes[:: -(-len(episodes) // SHOWN)]
    symbols = list(shown[0]["place"])
    for row, symbol in enumerate(symbols):
        plants.plot([each["place"][symbol] for each in shown], [row] * len(shown), "|", color="C0")
    plants.axvspan(0, 1, color="0.94")
    plants.set_yticks(range(len(symbols)), symbols)
    plants.set(xlim=(-0.05, 1.05), xticks=[0, 1], xticklabels=["least", "greatest"], title="parameters")
    pressures.plot([e["p1_bar"] for e in shown], [e["target_bar"] for e in shown], "o", color="C0")
    pressures.set(xlabel="supply [bar]", ylabel="target [bar]", title="pressures at the start")
    time = np.linspace(0, duration, 1001)
    for each in shown[:: -(-len(shown) // FLOWS)]:
        flow = np.full_like(time, each["leak"])
        for start, rise, hold, fall, height in each["applications"]:
            corners = np.cumsum([start, max(rise, 1e-9), hold, max(fall, 1e-9)])
            flow += np.interp(time, corners, [0, height, height, 0])
        flows.plot(time, 1e3 * flow, lw=1, label=f"{each['worst_bar']:.2f} bar")
    flows.set(xlabel="time [s]", ylabel="consumption [g/s]", title="some of them, with the excursion")
    flows.margins(y=0.15)
    flows.legend(loc="upper right", ncols=FLOWS)
    return drawn
