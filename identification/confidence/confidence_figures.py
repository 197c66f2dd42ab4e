"""Figures of the confidence stage: the error around its minimum (Figures 16, 17), and the region."""

from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from epv_env.plant.parameters import table
from identification.confidence.confidence import Confidence


def profiles(confidence: Confidence, *, report_2003: bool = False) -> Figure:
    """Total error over one parameter at a time, the others held (Figures 16 and 17).

    report_2003: with the intervals of eq. 23, too.
    """
    vector = confidence.problem.vector
    figure = Figure(figsize=(9, 5.5), layout="constrained")
    panels = _panels(figure, len(vector.symbols))
    centre = confidence.nelder_mead * vector.scale
    rows = zip(panels, vector.symbols, centre, confidence.minimum.profiles, strict=True)
    for axes, symbol, value, profile in rows:
        axes.plot(value * (1 + confidence.minimum.offsets), 100 * profile, color="tab:blue")
        if report_2003:
            low, high = confidence.report_intervals()[symbol]
            axes.axvspan(low, high, color="tab:red", alpha=0.4, label="eq. 23")
        low, high = confidence.intervals()[symbol]
        axes.axvspan(low, high, color="tab:green", alpha=0.3, label="95 % interval")
        axes.axvline(value, color="black", linewidth=0.6)
        axes.set_xlabel(_axis(symbol))
        axes.grid(alpha=0.3)
    panels[0].legend(fontsize="small")
    figure.supylabel("total error [%]")
    return figure


def region(confidence: Confidence) -> Figure:
    """The joint region seen along pairs of parameters, with the bootstrap and both estimates."""
    symbols = confidence.problem.vector.symbols
    pairs = list(combinations(range(len(symbols)), 2))
    figure = Figure(figsize=(9, 6), layout="constrained")
    for axes, pair in zip(_panels(figure, len(pairs)), pairs, strict=False):
        _pair(axes, confidence, pair)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize="small")
    return figure


def _pair(axes: Axes, confidence: Confidence, pair: tuple[int, int]) -> None:
    """One panel: everything relative to the estimate, in parts per thousand."""
    i, j = pair
    covariance = confidence.covariance
    centre = confidence.estimate
    relative = 1e3 / centre[list(pair)]
    cloud = confidence.bootstrap[::4, [i, j]] * relative
    axes.plot(*cloud.T, ".", color="tab:gray", markersize=1.5, label="block bootstrap")
    for matrix, style, label in (
        (covariance.independent, "--", "independent residuals, exact inputs"),
        (covariance.total, "-", "joint 95 % region"),
    ):
        outline = _ellipse(matrix[np.ix_(pair, pair)], confidence.chi_square) * relative
        axes.plot(*outline.T, style, color="tab:green", label=label)
    apart = (confidence.nelder_mead - centre)[[i, j]] * relative
    axes.plot(*apart, "x", color="tab:red", label="Nelder-Mead")
    axes.plot(0.0, 0.0, "+", color="black", label="least squares")
    symbols = confidence.problem.vector.symbols
    axes.set_xlabel(f"{symbols[i]}: change [‰]")
    axes.set_ylabel(f"{symbols[j]}: change [‰]")
    axes.grid(alpha=0.3)


def _ellipse(covariance: NDArray, radius: float) -> NDArray:
    """Outline (points, 2) of the ellipsoid's shadow on two of its axes."""
    angle = np.linspace(0.0, 2 * np.pi, 100)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.sqrt(radius) * circle @ np.linalg.cholesky(covariance).T


def _panels(figure: Figure, count: int) -> list[Axes]:
    columns = 2 if count <= 4 else 3
    panels = np.ravel(figure.subplots(-(-count // columns), columns, squeeze=False))
    for spare in panels[count:]:
        spare.remove()
    return list(panels[:count])


def _axis(symbol: str) -> str:
    unit = table()[symbol].unit
    return symbol if unit == "1" else f"{symbol} [{unit}]"
