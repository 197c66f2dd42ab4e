"""The report of a diagnosis as sections of the HTML page: sentences, tables and figures."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from identification.block_bootstrap import LEVEL
from identification.gap.diagnosis import MENTIONED_PROBABILITY, Diagnosis
from identification.gap.fit.evidence import EvaluatedHypothesis
from identification.gap.fit.gaps import FLOOR, regimes_of
from identification.gap.fit.laws import COMPONENTS
from identification.gap.fit.laws import in_words as in_words_of_laws
from identification.gap.judge.verdict import AMBIGUITY_SHARE, AMBIGUOUS, KNOWN, SURE_INCLUSION
from identification.gap.locate.localisation import Localisation
from identification.gap.plant import GreyBox
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.report.figures import (
    forcing_figure,
    gap_figure,
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
    inclusion,
    parameter_covariance,
    parameter_intervals,
)
from identification.gap.report.quantities import (
    gap_text,
    gap_with_interval,
    probability_text,
    quantity,
    quantity_with_interval,
)
from identification.gap.report.sentences import (
    at_an_end,
    disturbance_sentence,
    hidden_causes_sentence,
    in_words,
    location_sentence,
    look_alikes,
    parameters_at_bounds,
    reduction_sentence,
    remainder_sentence,
    share_closed,
    sizes_with_intervals,
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
    """The whole report: verdict, localisation, ranking, reduction, remainder, next experiment, warnings.

    next_experiment: a sentence or two; empty where none was sought. plan: what stands below it. more:
    sections that follow the remainder.
    """
    parts = [
        _verdict(diagnosis, next_experiment),
        _localisation(diagnosis),
        _ranking(diagnosis),
        _reduction(diagnosis),
        _remainder(diagnosis),
        *more,
    ]
    if next_experiment:
        verdict = Verdict(status="note", text=next_experiment)
        parts.append(Section(title="Next recording", verdicts=[verdict], blocks=list(plan)))
    return [*parts, _warnings(diagnosis)]


def _verdict(diagnosis: Diagnosis, next_experiment: str) -> Section:
    status, text = verdict_sentence(diagnosis, next_experiment)
    explanation = (
        "The gap is the root mean square of (model - measured)/noise on recordings that were never "
        "fitted to: 1 is noise alone. The nominal model has the parameters as given. The recalibrated "
        "model has its calibrated parameters refitted. With a cause, both are refitted together. "
        f"Intervals hold {LEVEL_TEXT}."
    )
    return Section(
        title="Verdict",
        summary=True,
        verdicts=[Verdict(status=status, text=text)],
        blocks=[calibrated_values(diagnosis, status), Text(text=explanation)],
    )


def _localisation(diagnosis: Diagnosis) -> Section:
    localisation = diagnosis.localisation
    blocks: list[Block] = [
        Picture(
            figure=heat_map(localisation.regime_gaps),
            caption="Gap after recalibration, by channel and regime; regimes may overlap.",
        ),
        residual(diagnosis, diagnosis.ranking.recalibrated, "Residual after recalibration"),
        Picture(
            figure=location_figure(diagnosis),
            caption="Left: the equation or reading in which something is missing, from the residual "
            "alone, whatever the catalogue. Right: the component at fault, from the named causes and "
            "the equations.",
        ),
    ]
    verdicts = [Verdict(status="note", text=location_sentence(diagnosis))]
    if localisation.missing_term:
        blocks += missing_term(diagnosis.ranking.problem.plant, localisation, "The recalibrated model")
    return Section(title="Where the gap lies", verdicts=verdicts, blocks=blocks)


def _ranking(diagnosis: Diagnosis) -> Section:
    ambiguity_set = diagnosis.conclusion.ambiguity_set
    verdicts = [Verdict(status="note", text=hidden_causes_sentence(diagnosis))]
    if ambiguity_set:
        names = ", ".join(cause.hypothesis.title for cause in ambiguity_set)
        share = f"{100 * AMBIGUITY_SHARE:g} %"
        text = f"The fewest causes that hold {share} of the probability of all causes: {names}."
        status = "good" if len(ambiguity_set) == 1 else "doubt"
        verdicts.insert(0, Verdict(status=status, text=text))
    blocks: list[Block] = [
        Picture(
            figure=ranking_figure(diagnosis),
            caption="Probability of each hypothesis; blue: the ambiguity set.",
        )
    ]
    if diagnosis.judged:
        blocks += [inclusion_table(diagnosis), ranking_table(diagnosis)]
    if diagnosis.named:
        blocks += drawn_laws(diagnosis, diagnosis.named.hypothesis)
    return Section(title="Which cause it is", verdicts=verdicts, blocks=blocks)


def _reduction(diagnosis: Diagnosis) -> Section:
    reduction, words = diagnosis.reduction, partial(in_words, diagnosis)
    blocks: list[Block] = [
        Picture(
            figure=gap_figure(reduction, words),
            caption="Gap of every model on held-out recordings with "
            f"{LEVEL_TEXT} intervals; red: noise alone.",
        ),
        gap_table(diagnosis),
    ]
    if diagnosis.best and diagnosis.conclusion.verdict in (KNOWN, AMBIGUOUS):
        best = diagnosis.best.hypothesis
        blocks.append(residual(diagnosis, best, f"Residual with {best.title}"))
    return Section(
        title="How far the gap shrinks",
        verdicts=[Verdict(status="note", text=reduction_sentence(diagnosis))],
        blocks=blocks,
    )


def _remainder(diagnosis: Diagnosis) -> Section:
    """What no named cause explains: how much, where, of which shape, and what is only disturbance."""
    blocks: list[Block] = []
    if diagnosis.remaining and diagnosis.best:
        name, plant = diagnosis.best.hypothesis.title, diagnosis.ranking.problem.plant
        blocks += missing_term(plant, diagnosis.remaining, f"The model with {name}")
        blocks.append(residual(diagnosis, diagnosis.best.hypothesis, f"Residual with {name}"))
    text = remainder_sentence(diagnosis)
    if not diagnosis.remaining:
        text = f"{text} {disturbance_sentence(diagnosis)}".strip()
    return Section(
        title="What remains",
        verdicts=[Verdict(status="note", text=text)],
        blocks=[*blocks, discrepancy_table(diagnosis)],
    )


def _warnings(diagnosis: Diagnosis) -> Section:
    texts = [*diagnosis.warnings, *parameters_at_bounds(diagnosis)]
    verdicts = [Verdict(status="doubt", text=f"{text}.") for text in texts]
    if not verdicts:
        text = "Every relevant fit has converged, and no fitted parameter is at an end of its range."
        verdicts = [Verdict(status="good", text=text)]
    return Section(title="Warnings", verdicts=verdicts, blocks=[])


def ranking_table(diagnosis: Diagnosis) -> Table:
    """Judged causes with their sizes, the share that each closes, and look-alikes."""
    return Table(
        columns=["Cause", "component", "probability", f"size ({LEVEL_TEXT})", "closes", "looks like"],
        rows=[
            [
                cause.hypothesis.title,
                ", ".join(
                    dict.fromkeys(
                        c.component.replace("_", " ")
                        for c in cause.hypothesis.estimate.hypothesis.causes
                    )
                ),
                probability_text(cause.probability),
                "; ".join(sizes_with_intervals(diagnosis, cause)),
                share_closed(diagnosis, cause),
                look_alikes(diagnosis, cause),
            ]
            for cause in diagnosis.judged
        ],
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
        "fitted size; dashed: the law that the catalogue assumes. In words: "
        f"{in_words_of_laws(estimate.laws)}."
    )
    return [Picture(figure=law_figure(drawn, units), caption=caption)]


def inclusion_table(diagnosis: Diagnosis) -> Table:
    """Probability that each effect is part of the gap, alone or beside others."""
    components = {cause.name: cause.component for cause in diagnosis.ranking.problem.plant.causes}
    rows = [
        [
            in_words(diagnosis, name),
            components[name].replace("_", " "),
            probability_text(probability),
            "yes" if name in diagnosis.conclusion.held else "-",
        ]
        for name, probability in inclusion(diagnosis).items()
        if probability >= MENTIONED_PROBABILITY
    ]
    return Table(
        columns=["Effect", "component", "part of the gap", "held"],
        rows=rows or [["none", "-", "-", "-"]],
        caption="Probability that an effect is part of the gap, alone or beside others, so that the "
        f"figures need not add to 100 %. Held: {100 * SURE_INCLUSION:g} % or more, and the verdict "
        "names causes.",
    )


def discrepancy_table(diagnosis: Diagnosis) -> Table:
    """What model and recordings differ by beyond noise under the best hypothesis, by channel."""
    channels = {channel.name: channel for channel in diagnosis.ranking.problem.plant.channels}
    return Table(
        columns=["Channel", "noise", "discrepancy", "correlated over"],
        rows=[
            [
                name,
                quantity((channels[name].noise or 0.0) / channels[name].scale, channels[name].unit),
                quantity(seen["sd"], channels[name].unit) if seen["sd"] else "none seen",
                quantity(seen["time_scale_s"], "s") if seen["sd"] else "-",
            ]
            for name, seen in discrepancy(diagnosis).items()
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
    caption = f"Noise deviations; {FLOOR:g} is noise alone."
    if shown:
        caption = (
            f"Left: noise deviations, {FLOOR:g} is noise alone. Right: mean distance of model and "
            "recording in percent of the recording's mean, every run with nominal offsets."
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
    model = f"with {kept.title}" if kept.labels else "recalibrated, without a cause"
    return Table(
        columns=["Parameter", "nominal", f"fitted ({LEVEL_TEXT} interval)", "trust it"],
        rows=rows,
        statuses=statuses,
        caption=f"Calibrated parameters of the model to use: {model}.",
    )


def missing_term(plant: GreyBox, localisation: Localisation, model: str) -> list[Block]:
    """The missing term over time, and over a state where one explains it."""
    forcing = localisation.likeliest
    if not forcing.windows:
        return []
    blocks: list[Block] = [
        Picture(
            figure=forcing_figure(plant, forcing),
            caption=f"{model} lacks this term in {forcing.equation.title}: the forcing with which it "
            "meets the recordings.",
        )
    ]
    term = drawn_term(localisation)
    if term:
        picture = missing_term_figure(term)
        caption = "The missing term over the state that explains it best."
        blocks.append(Picture(figure=picture, caption=caption))
    return blocks


def residual(diagnosis: Diagnosis, hypothesis: EvaluatedHypothesis, name: str) -> Picture:
    """Residual of the held-out run that recalibration misses most."""
    problem = diagnosis.ranking.problem
    recalibrated = diagnosis.ranking.recalibrated.residuals
    held_out = [r for r, run in enumerate(problem.plant.runs) if run.held_out]
    run = max(held_out, key=lambda r: np.mean(recalibrated[r] ** 2))
    masks = regimes_of(problem.plant, problem.candidate(hypothesis.estimate), run)
    return Picture(
        figure=residual_figure(problem.plant, run, hypothesis.residuals[run], masks),
        caption=f"{name}, on the held-out recording that recalibration misses most. Grey: where "
        f"{LEVEL_TEXT} of the noise lies.",
    )
