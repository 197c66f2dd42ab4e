"""Signals over time, one below the other: what was measured, and what a model says."""

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure
from numpy.typing import NDArray

LINES = {
    "measured": {"color": "black", "alpha": 0.35, "linewidth": 3.0},
    "model": {"color": "tab:blue"},
    "after": {"color": "tab:blue"},
    "before": {"color": "tab:orange", "linewidth": 1.6},
}
"""Looks of lines by the first word of their names; measured lies under thin models."""


def over_time(
    time: NDArray,
    rows: Mapping[str, Mapping[str, NDArray]],
    heights: Sequence[float] | None = None,
) -> Figure:
    """A row for each label of an axis, with its lines by name; one legend for all.

    Args:
        time: (samples,) [s].
        rows: by label with its unit, each line (samples,) in that unit; NaN is not drawn.
        heights: of the rows, relative to each other.
    """
    share = sum(heights) if heights else len(rows)
    figure = Figure(figsize=(9.5, 1.3 * share + 0.9), layout="constrained")
    drawn = figure.subplots(len(rows), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for axes, (label, lines) in zip(drawn, rows.items(), strict=True):
        for name, values in lines.items():
            look = {"linewidth": 0.9, **LINES.get(name.split(":")[0], {})}
            axes.plot(time, values, label=name, **look)
        axes.set_ylabel(label, fontsize="small")
        axes.grid(alpha=0.3)
    drawn[-1].set_xlabel("time [s]")
    lines = {line.get_label(): line for axes in drawn for line in axes.lines}
    figure.legend(lines.values(), lines.keys(), ncols=4, loc="outside upper center", frameon=False)
    figure.align_ylabels()
    return figure
