"""Figures of the ranking: probabilities, fitted sizes, changes of the calibrated parameters."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification.gap.diagnosis import Diagnosis, hypothesis_title
from identification.gap.model.free_parameter import FreeParameter
from identification.gap.report.labels import row_height, wrapped
from identification.gap.report.parameter_intervals import parameter_intervals
from identification.gap.report.quantities import (
    probability_text,
    quantity_with_interval,
    readable_unit,
    three_digits,
)
from identification.gap.report.sentences import mentioned_causes

NAMED, OTHER, NO_NAME = "tab:blue", "0.7", "tab:orange"
"""Colours: causes that the verdict names, other causes, hypotheses without a named cause."""

NO_CAUSE, UNKNOWN_CAUSE, NOTHING = "no cause needed", "not in the catalogue", "nothing missing"
OTHERS = "all other sets of causes"


def ranking_figure(diagnosis: Diagnosis) -> Figure:
    """Probability of each cause, of none and of an unknown one."""
    causes = {hypothesis_title(c.hypothesis): c.probability for c in diagnosis.judged}
    named = [hypothesis_title(c.hypothesis) for c in diagnosis.conclusion.ambiguity_set]
    rest = {NO_CAUSE: diagnosis.ranking.no_cause, UNKNOWN_CAUSE: diagnosis.ranking.unknown}
    colours = [NAMED if name in named else OTHER for name in (*causes, OTHERS)] + [NO_NAME] * len(rest)
    causes[OTHERS] = sum(diagnosis.ranking.probabilities) - sum(causes.values())
    figure = Figure(figsize=(7.5, 0.9 + 0.32 * row_height(causes) * len(colours)), layout="constrained")
    _bars(figure.subplots(), {wrapped(name): share for name, share in (causes | rest).items()}, colours)
    return figure


def location_figure(diagnosis: Diagnosis) -> Figure:
    """Probability that something is missing: by equation or reading, and by component."""
    localisation = diagnosis.localisation
    examined = {f.equation.name: f.equation.title for f in localisation.forcings}
    probabilities = localisation.equation_probabilities.items()
    equations = {examined[name]: share for name, share in probabilities if name in examined}
    equations[NOTHING] = localisation.nothing_missing
    found = diagnosis.conclusion.component_probabilities
    components = {name.replace("_", " "): share for name, share in found.items()}
    rows = max(len(equations), len(components))
    figure = Figure(figsize=(9.5, 0.9 + 0.28 * rows), layout="constrained")
    left, right = figure.subplots(1, 2)
    _bars(left, equations, [NAMED] * (len(equations) - 1) + [NO_NAME])
    _bars(right, components, [NAMED] * len(components))
    left.set_title("by state equation, no cause named")
    right.set_title("by component, causes named")
    return figure


def size_figure(diagnosis: Diagnosis) -> Figure:
    """Fitted sizes with intervals in their physical range; of improbable causes only if all are."""
    causes = mentioned_causes(diagnosis) or diagnosis.judged
    rows = [
        (hypothesis_title(cause.hypothesis), parameter, interval)
        for cause in causes
        for parameter, interval in zip(
            cause.hypothesis.estimate.hypothesis.parameters,
            parameter_intervals(diagnosis, cause.hypothesis),
            strict=True,
        )
    ]
    figure = Figure(
        figsize=(9.5, 0.7 + 0.62 * row_height(name for name, _, _ in rows) * len(rows)),
        layout="constrained",
    )
    axes = figure.subplots()
    for row, (_, parameter, interval) in enumerate(rows):
        _draw_in_range(axes, row, parameter, interval)
    names = [f"{wrapped(name)}\n{p.symbol}" for name, p, _ in rows]
    axes.set_yticks(range(len(rows)), names, fontsize=8)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlim(-0.03, 1.03)
    axes.set_xticks([])
    axes.set_xlabel("from one end of the physical range to the other (| nominal model)")
    for side in ("top", "right", "left", "bottom"):
        axes.spines[side].set_visible(False)
    return figure


def parameter_change_figure(diagnosis: Diagnosis) -> Figure:
    """How far the calibrated parameters moved from their nominal values [%]."""
    problem = diagnosis.ranking.problem
    estimates = {"recalibrated": diagnosis.ranking.recalibrated.estimate}
    if diagnosis.best:
        best = diagnosis.best.hypothesis
        estimates[f"with {hypothesis_title(best)}"] = best.estimate
    parameters = problem.plant.parameters
    symbols = [p.symbol for p in parameters]
    begin = problem.values(diagnosis.nominal)
    figure = Figure(figsize=(7.5, 1.1 + 0.35 * len(symbols)), layout="constrained")
    axes = figure.subplots()
    for shift, (name, estimate) in zip((-0.15, 0.15), estimates.items(), strict=False):
        values = problem.values(estimate)
        change = [100 * (values[p.symbol] - begin[p.symbol]) / _reference(p) for p in parameters]
        axes.plot(change, shift + np.arange(len(symbols)), "o", label=name)
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_yticks(range(len(symbols)), symbols)
    axes.set_ylim(len(symbols) - 0.5, -0.5)
    axes.set_xlabel("change from the nominal value [% of it, or of the usual size where it is 0]")
    axes.grid(alpha=0.3)
    figure.legend(loc="outside upper center", ncols=2, fontsize="small")
    return figure


def _reference(parameter: FreeParameter) -> float:
    """What a change is a share of [SI]: the nominal value, or the usual size where that is 0."""
    return abs(parameter.nominal) or abs(parameter.scale)


def _draw_in_range(
    axes: Axes, row: int, parameter: FreeParameter, interval: tuple[float, float, float]
) -> None:
    """One parameter and its interval [SI] on a line that stands for its range."""
    low, high = sorted((parameter.low, parameter.high))
    value, least, most = (np.array(interval) - low) / (high - low)
    axes.hlines(row, 0.0, 1.0, color="0.85", linewidth=7)
    axes.hlines(row, least, most, color=NAMED, linewidth=7, alpha=0.5)
    axes.plot((parameter.nominal - low) / (high - low), row, "|", color="black", markersize=14)
    axes.plot(value, row, "o", color=NAMED)
    unit, scale = readable_unit(parameter.unit, max(abs(low), abs(high)))
    ends = {
        "left": f"{three_digits(low / scale)} {unit}",
        "right": f"{three_digits(high / scale)} {unit}",
    }
    for side, text in ends.items():
        axes.text(side == "right", row + 0.38, text, ha=side, va="center", fontsize=7, color="0.4")
    middle = float(np.clip(value, 0.2, 0.8))
    text = quantity_with_interval(*interval, parameter.unit)
    axes.text(middle, row - 0.34, text, ha="center", va="center", fontsize=8)


def _bars(axes: Axes, probabilities: Mapping[str, float], colours: Sequence[str]) -> None:
    """Probabilities as horizontal bars, with their figures."""
    rows = range(len(probabilities))
    axes.barh(rows, list(probabilities.values()), color=colours, height=0.7)
    for row, probability in zip(rows, probabilities.values(), strict=True):
        axes.text(probability + 0.01, row, probability_text(probability), va="center", fontsize=8)
    axes.set_yticks(rows, list(probabilities), fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.12)
    axes.set_xticks([0.0, 0.5, 1.0], ["0", "50", "100"])
    axes.set_xlabel("probability [%]")
    axes.grid(axis="x", alpha=0.3)
