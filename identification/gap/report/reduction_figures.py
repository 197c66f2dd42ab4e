"""Figures of the discrepancy reduction: bars with intervals."""

from collections.abc import Callable

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from identification.gap.reduce.block_bootstrap import Interval
from identification.gap.reduce.discrepancy_reduction import DiscrepancyReduction
from identification.gap.reduce.gaps import FLOOR, Gap
from identification.gap.report.labels import row_height, wrapped


def gap_figure(reduction: DiscrepancyReduction, words: Callable[[str], str] = str) -> Figure:
    """Gap of every model on held-out runs, overall and by channel, with 90 % intervals.

    words: what people read instead of a cause's name.
    """
    gaps = {words(name): gap for name, gap in reduction.gaps.items()}
    models = {**gaps, "black box": reduction.black_box}
    panels = ["overall", *reduction.noise_ratios]
    figure = Figure(figsize=(10, 1.4 + 0.32 * row_height(models) * len(models)), layout="constrained")
    axes = figure.subplots(1, len(panels), sharey=True)
    for own, panel in zip(axes, panels, strict=True):
        _bars(own, [_interval(gap, panel) for gap in models.values()])
        own.axvline(FLOOR, color="tab:red", linewidth=1.0)
        own.set_title(panel)
        own.set_xscale("log")
        own.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        own.xaxis.set_major_formatter("{x:g}")
        own.xaxis.set_minor_formatter(NullFormatter())
        own.set_xlabel("gap [noise deviations]")
    axes[0].set_yticks(range(len(models)), [wrapped(name) for name in models])
    axes[0].invert_yaxis()
    return figure


def share_figure(reduction: DiscrepancyReduction, words: Callable[[str], str] = str) -> Figure:
    """Share of the explainable gap that each cause closes, with 90 % intervals.

    words: what people read instead of a cause's name.
    """
    names = [words(name) for name in reduction.shares_closed]
    figure = Figure(figsize=(7, 1.2 + 0.32 * row_height(names) * len(names)), layout="constrained")
    axes = figure.subplots()
    _bars(axes, [_percent(share) for share in reduction.shares_closed.values()])
    axes.set_yticks(range(len(names)), [wrapped(name) for name in names])
    axes.invert_yaxis()
    axes.set_xlim(0, 100)
    axes.set_xlabel("share of the explainable gap that is closed [%]")
    return figure


def _interval(gap: Gap, panel: str) -> Interval:
    return gap.overall if panel == "overall" else gap.channels[panel]


def _percent(share: Interval) -> Interval:
    return Interval(value=100 * share.value, low=100 * share.low, high=100 * share.high)


def _bars(axes: Axes, intervals: list[Interval]) -> None:
    """Horizontal bars with their intervals; no interval ends on the wrong side of its value."""
    values = [each.value for each in intervals]
    below = [max(each.value - each.low, 0.0) for each in intervals]
    above = [max(each.high - each.value, 0.0) for each in intervals]
    rows = range(len(intervals))
    axes.barh(rows, values, color="tab:blue", alpha=0.7, height=0.7)
    axes.errorbar(values, rows, xerr=[below, above], color="black", fmt="none", capsize=3, linewidth=1.0)
    axes.grid(axis="x", alpha=0.3)
