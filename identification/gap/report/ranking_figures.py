"""Pictures of which cause it is: what is probable, how large it would be, how parameters moved."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification.gap.diagnosis import Diagnosis, label
from identification.gap.model.grey_box import Size
from identification.gap.rank.verdict import Ranked
from identification.gap.report.json_export import magnitudes
from identification.gap.report.quantities import chance, interval, readable, short
from identification.gap.report.sentences import probable

NAMED, OTHER, NONE = "tab:blue", "0.7", "tab:orange"
"""Colours: what the verdict names, other causes, what is no cause."""

NO_CAUSE, UNKNOWN_CAUSE, NOTHING = "no cause needed", "not in the catalogue", "nothing missing"


def ranking(diagnosis: Diagnosis) -> Figure:
    """Probability of each cause, of none and of an unknown one."""
    causes = {label(cause.found): cause.probability for cause in diagnosis.judged}
    named = [label(cause.found) for cause in diagnosis.conclusion.ambiguity]
    rest = {NO_CAUSE: diagnosis.verdicts.no_cause, UNKNOWN_CAUSE: diagnosis.verdicts.unknown}
    colours = [NAMED if name in named else OTHER for name in causes] + [NONE] * len(rest)
    figure = Figure(figsize=(7.5, 0.9 + 0.32 * len(colours)), layout="constrained")
    _bars(figure.subplots(), causes | rest, colours)
    return figure


def places(diagnosis: Diagnosis) -> Figure:
    """Probability that something is missing: by equation or reading, and by component."""
    where = diagnosis.where
    able = {forcing.equation.name for forcing in where.forcings}
    equations = {name: share for name, share in where.equation.items() if name in able}
    equations[NOTHING] = where.none
    components = diagnosis.conclusion.component
    rows = max(len(equations), len(components))
    figure = Figure(figsize=(9.5, 0.9 + 0.28 * rows), layout="constrained")
    left, right = figure.subplots(1, 2)
    _bars(left, equations, [NAMED] * (len(equations) - 1) + [NONE])
    _bars(right, components, [NAMED] * len(components))
    left.set_title("by state equation, no cause named")
    right.set_title("by component, causes named")
    return figure


def sizes(causes: Sequence[Ranked]) -> Figure:
    """Fitted sizes with their 90 % intervals in their physical range; of faint causes if all are."""
    causes = probable(causes) or causes
    rows = [
        (label(cause.found), size, found)
        for cause in causes
        for size, found in zip(
            cause.found.point.hypothesis.sizes, magnitudes(cause.found).values(), strict=True
        )
    ]
    figure = Figure(figsize=(9.5, 0.7 + 0.62 * len(rows)), layout="constrained")
    axes = figure.subplots()
    for row, (_, size, found) in enumerate(rows):
        _in_range(axes, row, size, found)
    axes.set_yticks(range(len(rows)), [f"{name}\n{size.symbol}" for name, size, _ in rows], fontsize=8)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlim(-0.03, 1.03)
    axes.set_xticks([])
    axes.set_xlabel("from one end of the physical range to the other (| nominal model)")
    for side in ("top", "right", "left", "bottom"):
        axes.spines[side].set_visible(False)
    return figure


def moves(diagnosis: Diagnosis) -> Figure:
    """How far the calibrated parameters moved from where they began [%]."""
    fitter = diagnosis.verdicts.fitter
    points = {"recalibrated": diagnosis.verdicts.none.point}
    if diagnosis.best:
        points[f"with {label(diagnosis.best.found)}"] = diagnosis.best.found.point
    symbols = [size.symbol for size in fitter.plant.parameters]
    begin = fitter.values(diagnosis.nominal)
    figure = Figure(figsize=(7.5, 1.1 + 0.35 * len(symbols)), layout="constrained")
    axes = figure.subplots()
    for shift, (name, point) in zip((-0.15, 0.15), points.items(), strict=False):
        values = fitter.values(point)
        change = [100 * (values[symbol] / begin[symbol] - 1) for symbol in symbols]
        axes.plot(change, shift + np.arange(len(symbols)), "o", label=name)
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_yticks(range(len(symbols)), symbols)
    axes.set_ylim(len(symbols) - 0.5, -0.5)
    axes.set_xlabel("change from the nominal value [%]")
    axes.grid(alpha=0.3)
    figure.legend(loc="outside upper center", ncols=2, fontsize="small")
    return figure


def _in_range(axes: Axes, row: int, size: Size, found: tuple[float, float, float]) -> None:
    """One size on a line that is its range."""
    low, high = sorted((size.low, size.high))
    value, least, most = (np.array(found) - low) / (high - low)
    axes.hlines(row, 0.0, 1.0, color="0.85", linewidth=7)
    axes.hlines(row, least, most, color=NAMED, linewidth=7, alpha=0.5)
    axes.plot((size.off - low) / (high - low), row, "|", color="black", markersize=14)
    axes.plot(value, row, "o", color=NAMED)
    unit, scale = readable(size.unit, max(abs(low), abs(high)))
    ends = {"left": f"{short(low / scale)} {unit}", "right": f"{short(high / scale)} {unit}"}
    for side, text in ends.items():
        axes.text(side == "right", row + 0.38, text, ha=side, va="center", fontsize=7, color="0.4")
    middle = float(np.clip(value, 0.2, 0.8))
    axes.text(middle, row - 0.34, interval(*found, size.unit), ha="center", va="center", fontsize=8)


def _bars(axes: Axes, found: Mapping[str, float], colours: Sequence[str]) -> None:
    """Probabilities as horizontal bars, with their figures."""
    rows = range(len(found))
    axes.barh(rows, list(found.values()), color=colours, height=0.7)
    for row, probability in zip(rows, found.values(), strict=True):
        axes.text(probability + 0.01, row, chance(probability), va="center", fontsize=8)
    axes.set_yticks(rows, list(found), fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.12)
    axes.set_xticks([0.0, 0.5, 1.0], ["0", "50", "100"])
    axes.set_xlabel("probability [%]")
    axes.grid(axis="x", alpha=0.3)
