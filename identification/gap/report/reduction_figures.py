"""How far the gap shrinks, as bars with intervals."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from identification.gap.reduce.block_bootstrap import Interval
from identification.gap.reduce.discrepancy_reduction import Shrinkage
from identification.gap.reduce.gaps import FLOOR, Gap

BAR = {"color": "tab:blue", "alpha": 0.7, "height": 0.7}
ERROR = {"color": "black", "fmt": "none", "capsize": 3, "linewidth": 1.0}


def gaps(found: Shrinkage) -> Figure:
    """Gap of every model on held-out runs, overall and by channel, with 90 % intervals."""
    models = {**found.gaps, "black box": found.black_box_floor}
    panels = ["overall", *found.noise]
    figure = Figure(figsize=(10, 1.4 + 0.32 * len(models)), layout="constrained")
    axes = figure.subplots(1, len(panels), sharey=True)
    for one, panel in zip(axes, panels, strict=True):
        _bars(one, [_of(gap, panel) for gap in models.values()])
        one.axvline(FLOOR, color="tab:red", linewidth=1.0)
        one.set_title(panel)
        one.set_xscale("log")
        one.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        one.xaxis.set_major_formatter("{x:g}")
        one.xaxis.set_minor_formatter(NullFormatter())
        one.set_xlabel("gap [noise deviations]")
    axes[0].set_yticks(range(len(models)), list(models))
    axes[0].invert_yaxis()
    return figure


def shares(found: Shrinkage) -> Figure:
    """Share of the explainable gap that each cause closes, with 90 % intervals."""
    figure = Figure(figsize=(7, 1.2 + 0.32 * len(found.shrink)), layout="constrained")
    axes = figure.subplots()
    _bars(axes, [_percent(share) for share in found.shrink.values()])
    axes.set_yticks(range(len(found.shrink)), list(found.shrink))
    axes.invert_yaxis()
    axes.set_xlim(0, 100)
    axes.set_xlabel("share of the explainable gap that is closed [%]")
    return figure


def _of(gap: Gap, panel: str) -> Interval:
    return gap.overall if panel == "overall" else gap.channels[panel]


def _percent(share: Interval) -> Interval:
    return Interval(value=100 * share.value, low=100 * share.low, high=100 * share.high)


def _bars(axes: Axes, found: list[Interval]) -> None:
    """Horizontal bars with their intervals; no interval ends on the wrong side of its value."""
    values = [one.value for one in found]
    below = [max(one.value - one.low, 0.0) for one in found]
    above = [max(one.high - one.value, 0.0) for one in found]
    axes.barh(range(len(found)), values, **BAR)
    axes.errorbar(values, range(len(found)), xerr=[below, above], **ERROR)
    axes.grid(axis="x", alpha=0.3)
