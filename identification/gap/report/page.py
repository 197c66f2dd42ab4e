"""The report of a diagnosis as sections of the HTML page: sentences, tables and figures."""

from collections.abc import Sequence

import numpy as np

from identification.block_bootstrap import LEVEL
from identification.gap.diagnosis import Diagnosis
from identification.gap.fit.evidence import EvaluatedHypothesis
from identification.gap.fit.gaps import FLOOR, regimes_of
from identification.gap.fit.laws import COMPONENTS
from identification.gap.judge.verdict import AMBIGUITY_SHARE
from identification.gap.locate.localisation import Localisation
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.report.figures import (
    forcing_figure,
    heat_map,
    law_figure,
    location_figure,
    missing_term_figure,
    ranking_figure,
    residual_figure,
)
from identification.gap.report.gap_json import (
    discrepancy,
    drawn_term,
    parameter_covariance,
    parameter_intervals,
)
from identification.gap.report.quantities import (
    gap_text,
    gap_with_interval,
    quantity,
    quantity_with_interval,
)
from identification.gap.report.sentences import (
    at_an_end,
    component_at_fault,
    hidden_causes_sentence,
    in_words,
    look_alikes,
    parameters_at_bounds,
    share_closed,
    verdict_sentence,
)
from identification.report.page import ANSWERS, Block, Picture, Section, Table, Text, Verdict

LEVEL_TEXT = f"{100 * LEVEL:g} %"
"""Probability within the intervals."""


def sections(
    diagnosis: Diagnosis,
    next_experiment: str = "",
    plan: Sequence[Block] = (),
    more: Sequence[Section] = (),
) -> list[Section]:
    """The whole report: verdict, localisation, ranking, what remains, and the next recording.

    next_experiment: a sentence or two; empty where none was sought. plan: what it was chosen from. more:
    sections that follow the remainder.
    """
    parts = [_verdict(diagnosis, next_experiment), _localisation(diagnosis), _ranking(diagnosis)]
    parts += [_remainder(diagnosis), *more]
    if plan:
        parts.append(Section(title="Next recording", verdicts=[], blocks=list(plan)))
    return parts


def _verdict(diagnosis: Diagnosis, next_experiment: str) -> Section:
    """The first screen: what it is and how sure, why it is in doubt, what next, and the residual."""
    status, text = verdict_sentence(diagnosis, "")
    doubts = [*diagnosis.warnings, *parameters_at_bounds(diagnosis)]
    verdicts = [Verdict(status=status, text=text)]
    verdicts += [Verdict(status="doubt", text=f"{doubt}.") for doubt in doubts]
    if next_experiment:
        verdicts.append(Verdict(status="note", text=next_experiment))
    explanation = (
        "The gap is the root mean square of (model - measured)/noise on recordings that were never "
        f"fitted to: {FLOOR:g} is noise alone. The nominal model has the parameters as given. The "
        "recalibrated model has its calibrated parameters refitted. With a cause, both are refitted "
        f"together. Intervals hold {LEVEL_TEXT}."
    )
    return Section(
        title="Verdict",
        summary=True,
        verdicts=verdicts,
        blocks=[_residuals(diagnosis), calibrated_values(diagnosis, status), Text(text=explanation)],
    )


def _residuals(diagnosis: Diagnosis) -> Picture:
    """Residuals of the held-out run that recalibration misses most, before and with the best cause."""
    problem = diagnosis.ranking.problem
    models = {"recalibrated": diagnosis.ranking.recalibrated}
    if diagnosis.best:
        models[f"with {diagnosis.best.hypothesis.title}"] = diagnosis.best.hypothesis
    squares = [np.mean(residual**2) for residual in diagnosis.ranking.recalibrated.residuals]
    run = max((r for r, run in enumerate(problem.plant.runs) if run.held_out), key=squares.__getitem__)
    values = problem.candidate(list(models.values())[-1].estimate)
    masks = regimes_of(problem.plant, values, run)
    residuals = {name: model.residuals[run] for name, model in models.items()}
    return Picture(
        figure=residual_figure(problem.plant, run, residuals, masks),
        caption="What the model leaves of the held-out recording that recalibration misses most. Grey: "
        f"where {LEVEL_TEXT} of the noise lies.",
    )


def _localisation(diagnosis: Diagnosis) -> Section:
    verdicts = []
    if diagnosis.named:
        text = f"Most likely at fault: {component_at_fault(diagnosis)}."
        verdicts = [Verdict(status="note", text=text)]
    return Section(
        title="Where the gap lies",
        verdicts=verdicts,
        blocks=[
            Picture(
                figure=heat_map(diagnosis.localisation.regime_gaps),
                caption="Gap after recalibration, by channel and regime; regimes may overlap.",
            ),
            Picture(
                figure=location_figure(diagnosis),
                caption="Left: the equation or reading in which something is missing, from the residual "
                "alone, whatever the catalogue. Right: the component at fault, from the named causes "
                "and the equations.",
            ),
        ],
    )


def _ranking(diagnosis: Diagnosis) -> Section:
    blocks: list[Block] = [
        Picture(
            figure=ranking_figure(diagnosis),
            caption="Probability of each hypothesis; blue, where the verdict names causes: the fewest "
            f"that hold {100 * AMBIGUITY_SHARE:g} % of the probability of all causes.",
        )
    ]
    if diagnosis.judged:
        blocks.append(ranking_table(diagnosis))
    if diagnosis.named:
        blocks += drawn_laws(diagnosis, diagnosis.named.hypothesis)
    verdict = Verdict(status="note", text=hidden_causes_sentence(diagnosis))
    return Section(title="Which cause it is", verdicts=[verdict], blocks=blocks)


def _remainder(diagnosis: Diagnosis) -> Section:
    """What each model leaves, what no named cause explains, and what is only disturbance."""
    blocks: list[Block] = [gap_table(diagnosis)]
    left = diagnosis.remaining if diagnosis.named else diagnosis.localisation
    if left and left.missing_term:
        blocks += _missing_term(diagnosis, left)
    return Section(title="What remains", verdicts=[], blocks=[*blocks, discrepancy_table(diagnosis)])


def _missing_term(diagnosis: Diagnosis, left: Localisation) -> list[Block]:
    """The missing term over time, and over a state where one explains it."""
    forcing, named = left.likeliest, diagnosis.named
    model = f"The model with {named.hypothesis.title}" if named else "The recalibrated model"
    blocks: list[Block] = [
        Picture(
            figure=forcing_figure(diagnosis.ranking.problem.plant, forcing),
            caption=f"{model} lacks this term in {forcing.equation.title}: the forcing with which it "
            "meets the recordings.",
        )
    ]
    if term := drawn_term(left):
        caption = "The missing term over the state that explains it best."
        blocks.append(Picture(figure=missing_term_figure(term), caption=caption))
    return blocks


def ranking_table(diagnosis: Diagnosis) -> Table:
    """Judged causes with their sizes, the share that each closes, and look-alikes."""
    rows = []
    for cause in diagnosis.judged:
        intervals = parameter_intervals(diagnosis, cause.hypothesis)
        hypothesis = cause.hypothesis.estimate.hypothesis
        components = dict.fromkeys(c.component.replace("_", " ") for c in hypothesis.causes)
        sizes = [
            f"{p.title} = {quantity_with_interval(*intervals[p.symbol], p.unit)}"
            for p in hypothesis.cause_parameters
        ]
        closed, alike = share_closed(diagnosis, cause), look_alikes(diagnosis, cause)
        rows.append([cause.hypothesis.title, ", ".join(components), "; ".join(sizes), closed, alike])
    return Table(
        columns=["Cause", "component", f"size ({LEVEL_TEXT})", "closes", "looks like"],
        rows=rows,
        caption="'Looks like': causes that these recordings hardly tell apart from this one, with the "
        "correlation of both effects; from the model's sensitivities alone, whatever the residual.",
    )


def drawn_laws(diagnosis: Diagnosis, hypothesis: EvaluatedHypothesis) -> list[Block]:
    """The open laws of a hypothesis over their states, beside the law that is assumed."""
    problem, estimate = diagnosis.ranking.problem, hypothesis.estimate
    if not estimate.laws:
        return []
    covariance = parameter_covariance(diagnosis, hypothesis)
    symbols = [p.symbol for p in problem.parameters(estimate)]
    drawn = []
    for law, components in estimate.laws:
        growth, size = law.growth(components), law.cause.sizes[0]
        own = [symbols.index(p.symbol) for p in (*law.parameters, size)]
        value = problem.values(estimate)[size.symbol] - size.nominal
        # A larger size with a smaller g is the same strength: both count together.
        slopes = np.column_stack([COMPONENTS, (1.0 + growth) / value])
        sd = np.sqrt(np.diag(slopes @ covariance[np.ix_(own, own)] @ slopes.T))
        drawn.append((law, growth, sd))
    values, plant = problem.candidate(estimate), prepared(problem.plant)
    traces = plant.law_states(values, problem.fitted_runs[0])
    units = {name: (trace.unit, trace.scale) for name, trace in traces.items()}
    caption = (
        f"Strength of the cause over the state that it follows ({LEVEL_TEXT} band), relative to its "
        "fitted size; dashed: the law that the catalogue assumes."
    )
    return [Picture(figure=law_figure(drawn, units), caption=caption)]


def discrepancy_table(diagnosis: Diagnosis) -> Table:
    """What model and recordings differ by beyond noise under the best hypothesis, by channel."""
    seen = discrepancy(diagnosis)
    return Table(
        columns=["Channel", "noise", "discrepancy", "correlated over"],
        rows=[
            [
                channel.name,
                quantity((channel.noise or 0.0) / channel.scale, channel.unit),
                quantity(own["sd"], channel.unit) if own["sd"] else "none seen",
                quantity(own["time_scale_s"], "s") if own["sd"] else "-",
            ]
            for channel in diagnosis.ranking.problem.plant.channels
            for own in [seen[channel.name]]
        ],
        caption="Standard deviations of the sensor noise and of what differs beyond it under the best "
        "hypothesis: errors of its form, and disturbances.",
    )


def gap_table(diagnosis: Diagnosis) -> Table:
    """Gap of every model in noise deviations, and in percent where defined."""
    models = {**diagnosis.reduction.gaps, "black box": diagnosis.reduction.black_box}
    channels = list(diagnosis.reduction.noise_ratios)
    columns = ["overall", *channels]
    shown = columns if any(model.percent for model in models.values()) else []
    caption = "Gap of every model in noise deviations."
    if shown:
        caption += (
            " In percent: mean distance of model and recording, relative to the recording's mean, every "
            "run with nominal offsets."
        )
    if not diagnosis.reduction.black_box_helps:
        caption += (
            " The black box finds nothing in what recalibration leaves that holds on these recordings: "
            "the recalibrated model itself is the floor."
        )
    return Table(
        columns=["Model", *(f"{c} [noise]" for c in columns), *(f"{c} [%]" for c in shown)],
        rows=[
            [
                in_words(diagnosis, name),
                gap_with_interval(model.overall),
                *(gap_text(model.channels[channel].value) for channel in channels),
                *(f"{model.percent[column]:.2f}" if model.percent else "-" for column in shown),
            ]
            for name, model in models.items()
        ],
        caption=caption,
    )


def calibrated_values(diagnosis: Diagnosis, status: str) -> Table:
    """Calibrated parameters of the model to use, with intervals; status: of the verdict."""
    kept = diagnosis.kept
    intervals = parameter_intervals(diagnosis, kept)
    rows, statuses = [], []
    for parameter in diagnosis.ranking.problem.plant.parameters:
        interval = intervals[parameter.symbol]
        own = "bad" if at_an_end(parameter, interval[0]) else status
        why = ": at an end of its range" if own != status else ""
        rows.append(
            [
                parameter.title,
                quantity(parameter.nominal, parameter.unit),
                quantity_with_interval(*interval, parameter.unit),
                ANSWERS[own] + why,
            ]
        )
        statuses.append(own)
    model = f"with {kept.title}" if kept.labels else f"{diagnosis.kept_label}, without a cause"
    return Table(
        columns=["Parameter", "nominal", f"fitted ({LEVEL_TEXT} interval)", "trust it"],
        rows=rows,
        statuses=statuses,
        caption=f"Calibrated parameters of the model to use: {model}.",
    )
