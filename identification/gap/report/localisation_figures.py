"""Figures of the fault localisation."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import norm

from identification.gap.locate.fault_localisation import ForcingEstimate, MissingTerm
from identification.gap.locate.regime_gaps import RegimeGap
from identification.gap.model.grey_box import GreyBox
from identification.gap.reduce.gaps import FLOOR

BAND = "lightskyblue"
"""Colour of an interval."""


def heat_map(gaps: Sequence[RegimeGap], largest: float) -> Figure:
    """Gap of every channel in every regime, with its interval.

    largest: upper end of the colours, unless a gap is larger [noise deviations].
    """
    channels = list(dict.fromkeys(gap.channel for gap in gaps))
    regimes = list(dict.fromkeys(gap.regime for gap in gaps))
    figure = Figure(figsize=(1.1 * len(regimes) + 1.6, 0.75 * len(channels) + 1.3), layout="constrained")
    axes = figure.subplots()
    table = np.full((len(channels), len(regimes)), np.nan)
    for gap in gaps:
        table[channels.index(gap.channel), regimes.index(gap.regime)] = gap.gap
    colours = LogNorm(FLOOR, max(largest, float(np.nanmax(table))), clip=True)
    image = axes.imshow(table, norm=colours, cmap="YlOrRd", aspect="auto")
    for gap in gaps:
        axes.text(
            regimes.index(gap.regime), channels.index(gap.channel),
            f"{_two_digits(gap.gap)}{'' if gap.held_out else '*'}\n{_interval(gap)}",
            ha="center", va="center", fontsize=8, color="white" if colours(gap.gap) > 0.7 else "black",
        )  # fmt: skip
    axes.set_xticks(range(len(regimes)), [name.replace("_", "\n") for name in regimes], fontsize=9)
    axes.set_yticks(range(len(channels)), channels)
    figure.colorbar(image, label="gap [noise deviations]", ticks=[1, 2, 5, 10], format="%g")
    if not all(gap.held_out for gap in gaps):
        axes.set_xlabel("* too rare on held-out runs: all runs", fontsize=8)
    return figure


def _interval(gap: RegimeGap) -> str:
    return f"{_two_digits(gap.low)} - {_two_digits(gap.high)}" if np.isfinite(gap.high) else "too rare"


def _two_digits(gap: float) -> str:
    """A gap to two digits, or to the integer."""
    return f"{gap:.1f}" if gap < 9.95 else f"{gap:.0f}"


def residual_figure(
    plant: GreyBox, run: int, residual: NDArray, masks: Mapping[str, NDArray], level: float
) -> Figure:
    """Residual of a run over time, with the regimes in strips above.

    Args:
        plant: the plant with its recordings.
        run: index of the run.
        residual: (channels, samples) [noise deviations].
        masks: samples of each regime, boolean (samples,) by name.
        level: probability of the band in which noise lies.
    """
    band = float(norm.ppf(0.5 + level / 2))
    time = plant.runs[run].time
    figure = Figure(figsize=(9.5, 1.6 * len(residual) + 0.2 * len(masks) + 1), layout="constrained")
    rows = figure.subplots(
        1 + len(residual), 1, sharex=True, height_ratios=[0.12 * len(masks), *[1.0] * len(residual)]
    )
    for row, mask in enumerate(masks.values()):
        rows[0].fill_between(
            time, row - 0.4, row + 0.4, where=mask.tolist(), color=f"C{row}", step="mid", linewidth=0.0
        )
    rows[0].set_yticks(range(len(masks)), [name.replace("_", " ") for name in masks], fontsize=7)
    rows[0].invert_yaxis()
    for axes, channel, values in zip(rows[1:], plant.channels, residual, strict=True):
        axes.axhspan(-band, band, color="0.85")
        axes.plot(time, values, color="black", linewidth=0.6)
        axes.set_ylabel(f"{channel.name}\n[noise deviations]", fontsize=8)
        axes.grid(alpha=0.3)
    rows[-1].set_xlabel("time [s]")
    figure.suptitle(f"measured - model: {plant.runs[run].name}")
    figure.align_ylabels()
    return figure


def missing_term_figure(term: MissingTerm, level: float) -> Figure:
    """The missing term over the state that explains it best, and what single windows need.

    level: probability of the band around the term.
    """
    margin = float(norm.ppf(0.5 + level / 2)) * term.sd
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.subplots()
    axes.plot(term.x, term.scatter, ".", color="0.6", markersize=4, label="single windows")
    axes.fill_between(term.x, term.y - margin, term.y + margin, color=BAND, linewidth=0.0)
    axes.plot(term.x, term.y, color="tab:blue", label=f"as a function of the state, {level:.0%}")
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set_xlabel(f"{term.state} [{term.state_unit}]")
    missing = term.equation
    axes.set_ylabel(f"missing in d{missing.state}/dt,\n{missing.title} [{missing.unit}]")
    axes.set_title(f"alone has {term.explained:.0%} of the forcing's effect", fontsize="small")
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
    return figure


def forcing_figure(plant: GreyBox, forcing: ForcingEstimate, level: float) -> Figure:
    """The forcing of a state equation over time, run by run.

    level: probability of the band around the forcing.
    """
    quantile = float(norm.ppf(0.5 + level / 2))
    runs = list(dict.fromkeys(window.run for window in forcing.windows))
    figure = Figure(figsize=(9.5, 1.5 * len(runs) + 0.8), layout="constrained")
    rows = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
    for axes, run in zip(rows, runs, strict=True):
        mine = [j for j, window in enumerate(forcing.windows) if window.run == run]
        edges = [forcing.windows[j].begin for j in mine] + [forcing.windows[mine[-1]].end]
        value, sd = forcing.forcing[mine], quantile * forcing.sd[mine]
        low, high = np.append(value - sd, value[-1] - sd[-1]), np.append(value + sd, value[-1] + sd[-1])
        axes.fill_between(edges, low, high, step="post", color=BAND, linewidth=0.0)
        axes.stairs(value, edges, baseline=None, color="tab:blue")
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_title(plant.runs[run].name, fontsize=9)
        axes.set_ylabel(f"{forcing.equation.name} [{forcing.equation.unit}]", fontsize=8)
        axes.grid(alpha=0.3)
    rows[-1].set_xlabel("time [s]")
    return figure
