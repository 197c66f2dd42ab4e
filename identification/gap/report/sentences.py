"""Sentences of the report beside the verdict: where the gap lies, what is left, what is hidden."""

from collections.abc import Sequence

from identification.gap.diagnosis import Diagnosis, hypothesis_label, hypothesis_title
from identification.gap.rank.verdict import NO_GAP, RankedCause
from identification.gap.reduce.discrepancy_reduction import NOMINAL, RECALIBRATED
from identification.gap.reduce.gaps import FLOOR
from identification.gap.report.names import in_words
from identification.gap.report.parameter_intervals import parameter_intervals
from identification.gap.report.quantities import (
    gap_text,
    gap_with_interval,
    probability_text,
    quantity,
    quantity_with_interval,
    share_text,
)


def component_at_fault(diagnosis: Diagnosis) -> str:
    """The component that is most probably at fault, and its likeliest equation or reading."""
    component, probability = next(iter(diagnosis.conclusion.component_probabilities.items()))
    localisation = diagnosis.localisation
    equations = [
        forcing.equation.name
        for forcing in localisation.forcings
        if forcing.equation.component == component
    ]
    equation = max(equations, key=lambda name: localisation.equation_probabilities[name], default="")
    meaning = next(
        (f.equation.meaning for f in localisation.forcings if f.equation.name == equation), ""
    )
    named = "".join(f"{part}, " for part in (meaning, equation) if part)
    return f"{component.replace('_', ' ')} ({named}{probability_text(probability)})"


def location_sentence(diagnosis: Diagnosis) -> str:
    """Where most of the gap lies."""
    worst = max(diagnosis.localisation.regime_gaps, key=lambda gap: gap.gap)
    text = (
        f"After recalibration the gap is largest in {worst.channel} during "
        f"{worst.regime.replace('_', ' ')}: {gap_text(worst.gap)} noise deviations, where {FLOOR:g} is "
        "noise alone."
    )
    if diagnosis.conclusion.verdict == NO_GAP:
        return text
    return f"{text} Most likely at fault: {component_at_fault(diagnosis)}."


def reduction_sentence(diagnosis: Diagnosis) -> str:
    """The gap of every model, from the nominal one to the black box."""
    gaps = diagnosis.reduction.gaps
    models = {"nominal": gaps[NOMINAL], "recalibrated": gaps[RECALIBRATED]}
    if diagnosis.best:
        name = hypothesis_label(diagnosis.best.hypothesis)
        models[f"with {hypothesis_title(diagnosis.best.hypothesis)}"] = gaps[name]
    models["with a black box on top of recalibration"] = diagnosis.reduction.black_box
    listed = "; ".join(f"{name} {gap_with_interval(gap.overall)}" for name, gap in models.items())
    text = (
        f"Gap on recordings never fitted to, in noise deviations ({FLOOR:g} is noise alone): {listed}."
    )
    if diagnosis.reduction.black_box_helps:
        return text
    return (
        f"{text} The black box finds nothing in what recalibration leaves that holds on these "
        "recordings: the recalibrated model itself is the floor."
    )


def hidden_causes_sentence(diagnosis: Diagnosis) -> str:
    """Causes that the recordings cannot show, whatever the residual."""
    absorbed = [in_words(diagnosis, label) for label in diagnosis.ranking.separability.absorbed]
    if not absorbed:
        return "At its usual size every cause of the catalogue would show in these recordings."
    return (
        f"At the usual size these recordings would not show {', '.join(absorbed)}: recalibration, run "
        "offsets and the scatter of units absorb these causes. The diagnosis says nothing about them."
    )


def look_alikes(diagnosis: Diagnosis, cause: RankedCause) -> str:
    """Causes that the recordings hardly tell from one cause, with the signatures' correlation."""
    separability = diagnosis.ranking.separability
    place = separability.labels.index
    twins = [
        f"{in_words(diagnosis, twin)} ({abs(separability.correlation[place(label), place(twin)]):.3f})"
        for label in cause.hypothesis.labels
        for twin in separability.twins(label)
    ]
    return ", ".join(twins) or "-"


def parameters_at_bounds(diagnosis: Diagnosis) -> list[str]:
    """Fitted parameters at an end of their physical range, after recalibration and of likely causes."""
    problem = diagnosis.ranking.problem
    estimates = {RECALIBRATED: diagnosis.ranking.recalibrated.estimate}
    estimates |= {
        hypothesis_title(cause.hypothesis): cause.hypothesis.estimate
        for cause in mentioned_causes(diagnosis)
    }
    tolerance = diagnosis.settings.report.bound_tolerance
    return [
        f"{name}: {p.symbol} is at an end of its physical range ({quantity(value, p.unit)})"
        for name, estimate in estimates.items()
        for p in problem.parameters(estimate)
        for value in [problem.values(estimate)[p.symbol]]
        if min(abs(value - p.low), abs(value - p.high)) <= tolerance * abs(p.high - p.low)
    ]


def mentioned_causes(diagnosis: Diagnosis) -> Sequence[RankedCause]:
    """Judged causes with a noticeable probability."""
    least = diagnosis.settings.report.mentioned_probability
    return [cause for cause in diagnosis.judged if cause.probability >= least]


def share_closed(diagnosis: Diagnosis, cause: RankedCause) -> str:
    """The share of the gap that a cause closes, with its interval."""
    return share_text(diagnosis.share_closed(cause))


def sizes_with_intervals(diagnosis: Diagnosis, cause: RankedCause) -> list[str]:
    """Each fitted parameter of a cause with its interval."""
    parameters = cause.hypothesis.estimate.hypothesis.parameters
    intervals = parameter_intervals(diagnosis, cause.hypothesis)
    return [
        f"{p.symbol} = {quantity_with_interval(*interval, p.unit)}"
        for p, interval in zip(parameters, intervals, strict=True)
    ]


def sizes_text(diagnosis: Diagnosis, cause: RankedCause) -> str:
    """Each fitted parameter of a cause, without its interval."""
    values = diagnosis.ranking.problem.values(cause.hypothesis.estimate)
    return " and ".join(
        f"{p.symbol} = {quantity(values[p.symbol], p.unit)}"
        for p in cause.hypothesis.estimate.hypothesis.parameters
    )
