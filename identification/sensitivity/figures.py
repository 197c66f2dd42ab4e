"""Pictures of the sensitivity study: collinearity of pairs, and global indices."""

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from identification.sensitivity.collinearity import (
    CRITICAL_INDEX,
    OutputSensitivities,
    collinearity_index,
)
from identification.sensitivity.global_indices import SobolIndices

GREATEST_SHOWN = 100.0
"""Collinearity indices above this share a colour."""


def collinearity_map(outputs: OutputSensitivities) -> Figure:
    """Collinearity index of every pair; those from 10 up are written out."""
    figure = Figure(figsize=(9, 8), layout="constrained")
    axes = figure.subplots()
    index = pairwise_indices(outputs)
    norm = LogNorm(1, GREATEST_SHOWN)
    shown = axes.imshow(np.minimum(index, GREATEST_SHOWN), norm=norm, cmap="Blues")
    figure.colorbar(
        shown, ax=axes, label=f"collinearity index (above {GREATEST_SHOWN:g}: as {GREATEST_SHOWN:g})"
    )
    for row, column in np.argwhere(index >= CRITICAL_INDEX):
        text = "∞" if np.isinf(index[row, column]) else f"{index[row, column]:.0f}"
        colour = "white" if index[row, column] > 30 else "black"
        axes.text(column, row, text, ha="center", va="center", fontsize=7, color=colour)
    axes.set_xticks(range(len(outputs.symbols)), outputs.symbols, rotation=90)
    axes.set_yticks(range(len(outputs.symbols)), outputs.symbols)
    return figure


def pairwise_indices(outputs: OutputSensitivities) -> NDArray:
    """Collinearity index of each pair below the diagonal, NaN elsewhere.

    Returns (parameters, parameters), without unit.
    """
    n = len(outputs.symbols)
    index = np.full((n, n), np.nan)
    for row in range(n):
        for column in range(row):
            index[row, column] = collinearity_index(outputs.columns[:, [row, column]])
    return index


def global_bars(indices: SobolIndices) -> Figure:
    """Sobol's indices with 95 % intervals, by falling total."""
    order = np.argsort(indices.total)
    figure = Figure(figsize=(9, 7.5), layout="constrained")
    axes = figure.subplots()
    rows = np.arange(len(order))
    bars = (
        ("total", indices.total, indices.total_half_width, 0.2, "tab:blue"),
        ("first order", indices.first, indices.first_half_width, -0.2, "tab:orange"),
    )
    for label, values, width, shift, colour in bars:
        axes.barh(
            rows + shift,
            values[order],
            xerr=width[order],
            error_kw={"elinewidth": 1},
            height=0.38,
            color=colour,
            alpha=0.6,
            label=label,
        )
    axes.set_yticks(rows, [indices.symbols[at] for at in order])
    axes.set_xlabel("Sobol index: share of the variance")
    axes.legend(loc="lower right")
    axes.set_ylim(-0.6, len(order) - 0.4)
    axes.grid(axis="x", alpha=0.3)
    return figure
