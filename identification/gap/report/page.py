"""The report of a diagnosis as sections of the HTML page: a verdict of one screen, the rest folded."""

from collections.abc import Mapping, Sequence

import numpy as np

from identification.block_bootstrap import LEVEL
from identification.gap.diagnosis import MENTIONED_PROBABILITY, Diagnosis
from identification.gap.fit.evidence import EvaluatedHypothesis
from identification.gap.fit.gaps import FLOOR, RegimeGap
from identification.gap.judge.verdict import NO_GAP
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.report.figures import (
    comparison_figure,
    forcing_figure,
    law_figure,
    missing_term_figure,
)
from identification.gap.report.gap_json import (
    differing_laws,
    discrepancy,
    drawn_term,
    parameter_intervals,
    remainder,
)
from identification.gap.report.sentences import (
    Words,
    at_an_end,
    gap_text,
    gap_with_interval,
    in_words,
    look_alikes,
    probability_text,
    quantity,
    quantity_with_interval,
    share_text,
    words_of,
)
from identification.report.page import ANSWERS, Block, Picture, Section, Table, Verdict

LEVEL_TEXT = f"{100 * LEVEL:g} %"
"""Probability within the intervals."""

GAP_EXPLAINED = (
    "The gap is the root mean square of (model - measured)/noise on recordings that were never fitted "
    f"to: {FLOOR:g} is noise alone. The nominal model has the parameters as given. The recalibrated "
    "model has its calibrated parameters refitted. With a cause, both are refitted together. Intervals "
    f"hold {LEVEL_TEXT}."
)


def sections(
    diagnosis: Diagnosis,
    next_experiment: str = "",
    plan: Sequence[Block] = (),
    more: Sequence[Section] = (),
) -> list[Section]:
    """The whole report: the verdict, and what it rests on.

    next_experiment: a sentence or two; empty where none was sought. plan: what it was chosen from. more:
    sections that follow the diagnosis.
    """
    words = words_of(diagnosis)
    parts = [
        _verdict(diagnosis, words, next_experiment),
        Section(title="Values to use", blocks=[calibrated_values(diagnosis, words.status)]),
        Section(
            title="How large the gap is",
            blocks=[GAP_EXPLAINED, gap_table(diagnosis), discrepancy_table(diagnosis)],
        ),
    ]
    if diagnosis.conclusion.verdict != NO_GAP:
        parts.append(_localisation(diagnosis, words))
    return [
        *parts,
        _causes(diagnosis, words),
        *more,
        *([Section(title="Next recording", blocks=plan)] if plan else []),
    ]


def _verdict(diagnosis: Diagnosis, words: Words, next_experiment: str) -> Section:
    """The first screen: what it is and how sure, why it is in doubt, what shows it, what next."""
    nothing_missing = diagnosis.conclusion.verdict == NO_GAP
    verdicts = [
        Verdict(status=words.status, text=words.what),
        *([Verdict(status="note", text=words.hidden)] if nothing_missing else []),
        *(Verdict(status="why", text=doubt) for doubt in words.doubts),
        *([Verdict(status="next", text=next_experiment)] if next_experiment else []),
    ]
    caption = (
        "Readings and model before and after, on a recording that was never fitted to: one of those "
        "that the correction improves most."
    )
    picture = Picture(figure=comparison_figure(diagnosis), caption=caption)
    return Section(title="Verdict", summary=True, verdicts=verdicts, blocks=[picture])


def _localisation(diagnosis: Diagnosis, words: Words) -> Section:
    """The gap by regime, the probability of each place, and the shape of what is missing."""
    localisation, left = diagnosis.localisation, remainder(diagnosis)
    titles = {f.equation.name: f.equation.title for f in localisation.forcings}
    equations = {titles.get(k, k): p for k, p in localisation.equation_probabilities.items()}
    equations["nothing missing"] = localisation.nothing_missing
    components = diagnosis.conclusion.component_probabilities
    blocks: list[Block] = [
        regime_table(localisation.regime_gaps),
        probability_table(
            "Component", {name.replace("_", " "): p for name, p in components.items()},
            "From the named causes and the equations.",
        ),
        probability_table(
            "Equation or reading", equations,
            "Where something is missing, from the residual alone, whatever the catalogue.",
        ),
    ]  # fmt: skip
    if left and left.missing_term:
        forcing, term = left.likeliest, drawn_term(left)
        named = f"with {diagnosis.named.hypothesis.title}" if diagnosis.named else "recalibrated"
        figure = (
            missing_term_figure(term)
            if term
            else forcing_figure(diagnosis.ranking.problem.plant, forcing)
        )
        caption = f"What the model ({named}) lacks in {forcing.equation.title} to meet the recordings"
        over = f", over the state that explains {term.explained:.0%} of it." if term else ", over time."
        blocks.append(Picture(figure=figure, caption=caption + over))
    verdict = Verdict(status="note", text=words.where)
    return Section(
        title="Where the gap lies", verdicts=[verdict] if diagnosis.named else [], blocks=blocks
    )


def regime_table(gaps: Sequence[RegimeGap]) -> Table:
    """Gap of every channel in every regime, with its interval."""
    channels = list(dict.fromkeys(gap.channel for gap in gaps))
    cells = {
        (gap.regime, gap.channel): f"{gap_text(gap.gap)} "
        + (f"({gap_text(gap.low)} to {gap_text(gap.high)})" if np.isfinite(gap.high) else "(too rare)")
        + ("" if gap.held_out else " *")
        for gap in gaps
    }
    rows = [
        [regime.replace("_", " "), *(cells.get((regime, channel), "-") for channel in channels)]
        for regime in dict.fromkeys(gap.regime for gap in gaps)
    ]
    caption = "Gap after recalibration, by regime and channel; regimes may overlap."
    if not all(gap.held_out for gap in gaps):
        caption += " * too rare in recordings never fitted to: all recordings."
    return Table(columns=["Regime", *channels], rows=rows, caption=caption)


def probability_table(heading: str, probabilities: Mapping[str, float], caption: str) -> Table:
    """Probabilities that are worth a mention, the highest first."""
    ordered = sorted(probabilities.items(), key=lambda pair: -pair[1])
    rows = [[name, probability_text(p)] for name, p in ordered if p >= MENTIONED_PROBABILITY]
    return Table(columns=[heading, "probability"], rows=rows, caption=caption)


def _causes(diagnosis: Diagnosis, words: Words) -> Section:
    """The causes with their probabilities, their laws, and what the recordings cannot show."""
    blocks: list[Block] = [ranking_table(diagnosis)]
    if diagnosis.named:
        blocks += drawn_laws(diagnosis, diagnosis.named.hypothesis)
    verdict = Verdict(status="note", text=words.hidden)
    return Section(title="Which causes were weighed", verdicts=[verdict], blocks=blocks)


def ranking_table(diagnosis: Diagnosis) -> Table:
    """Causes that are worth a mention: their sizes, the share that each closes, and look-alikes."""
    ranking, named = diagnosis.ranking, diagnosis.conclusion.ambiguity_set
    rows = []
    for cause in diagnosis.judged:
        if cause.probability < MENTIONED_PROBABILITY and cause not in (*named, diagnosis.best):
            continue
        intervals = parameter_intervals(diagnosis, cause.hypothesis)
        sizes = "; ".join(
            f"{p.title} = {quantity_with_interval(*intervals[p.symbol], p.unit)}"
            for p in cause.hypothesis.estimate.hypothesis.cause_parameters
        )
        closed = share_text(diagnosis.share_closed(cause))
        probability = probability_text(cause.probability)
        title, alike = cause.hypothesis.title, look_alikes(diagnosis, cause)
        rows.append([title, probability, sizes, closed, alike])
    judged = sum(cause.probability for cause in diagnosis.judged)
    others = {
        "all other sets of causes": sum(ranking.probabilities) - judged,
        "no cause": ranking.no_cause,
        "not in the catalogue": ranking.unknown,
    }
    rest = probability_table("", others, "").rows
    columns = ("Cause", "probability", f"size ({LEVEL_TEXT})", "share closed", "indistinguishable from")
    return Table(
        columns=columns,
        rows=[*rows, *([*row, "-", "-", "-"] for row in rest)],
        caption=f"Causes with a probability of {MENTIONED_PROBABILITY:.0%} or more. Share closed: "
        "of the gap, on recordings never fitted to. Indistinguishable: these recordings would hardly "
        "tell both causes apart, whatever the residual; with the correlation of what they change.",
    )


def drawn_laws(diagnosis: Diagnosis, hypothesis: EvaluatedHypothesis) -> list[Block]:
    """The laws that differ from the assumed one over their states, beside it."""
    problem, estimate = diagnosis.ranking.problem, hypothesis.estimate
    laws = [(law, law.growth(z), sd) for law, z, sd in differing_laws(diagnosis, hypothesis)]
    if not laws:
        return []
    values, plant = problem.candidate(estimate), prepared(problem.plant)
    traces = plant.law_states(values, problem.fitted_runs[0])
    units = {name: (trace.unit, trace.scale) for name, trace in traces.items()}
    caption = (
        f"Strength of the cause over the state that it follows ({LEVEL_TEXT} band), relative to its "
        "fitted size; dashed: the law that the catalogue assumes."
    )
    return [Picture(figure=law_figure(laws, units), caption=caption)]


def discrepancy_table(diagnosis: Diagnosis) -> Table:
    """What model and recordings differ by beyond noise under the best hypothesis, by channel."""
    channels = diagnosis.ranking.problem.plant.channels
    rows = [
        [
            channel.name,
            quantity((channel.noise or 0.0) / channel.scale, channel.unit),
            quantity(seen["sd"], channel.unit) if seen["sd"] else "none seen",
            quantity(seen["time_scale_s"], "s") if seen["sd"] else "-",
        ]
        for channel, seen in zip(channels, discrepancy(diagnosis).values(), strict=True)
    ]
    return Table(
        columns=["Channel", "noise", "discrepancy", "correlated over"],
        rows=rows,
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
    model = diagnosis.model
    intervals = parameter_intervals(diagnosis, model)
    rows, statuses = [], []
    for parameter in diagnosis.ranking.problem.plant.parameters:
        interval = intervals[parameter.symbol]
        at_end = at_an_end(parameter, interval[0])
        statuses.append("bad" if at_end else status)
        reason = "at an end of its range" if at_end else "see the verdict"
        rows.append(
            [
                parameter.title,
                quantity(parameter.nominal, parameter.unit),
                quantity_with_interval(*interval, parameter.unit),
                ANSWERS[statuses[-1]] + ("" if statuses[-1] == "good" else f": {reason}"),
            ]
        )
    name = f"with {model.title}" if model.labels else f"{diagnosis.model_label}, without a cause"
    return Table(
        columns=["Parameter", "nominal", f"fitted ({LEVEL_TEXT} interval)", "trust it"],
        rows=rows,
        statuses=statuses,
        caption=f"Calibrated parameters of the model to use: {name}.",
    )
