"""The report of a diagnosis as sections of the HTML page."""

from functools import partial

from identification.gap.diagnosis import Diagnosis, hypothesis_title
from identification.gap.rank.verdict import AMBIGUOUS, KNOWN, NO_GAP
from identification.gap.report import (
    localisation_figures,
    ranking_figures,
    reduction_figures,
    sentences,
    tables,
)
from identification.gap.report.calibrated_values import calibrated_values
from identification.gap.report.localisation_blocks import (
    level_text,
    missing_term,
    percent,
    residual,
)
from identification.gap.report.names import in_words
from identification.gap.report.remainder_sentences import disturbance_sentence, remainder_sentence
from identification.gap.report.verdict_sentences import verdict_sentence
from identification.report.page import Block, Picture, Section, Text, Verdict


def sections(diagnosis: Diagnosis, next_experiment: str = "") -> list[Section]:
    """The whole report: verdict, localisation, ranking, reduction, remainder, next experiment, warnings.

    next_experiment: a sentence or two; empty where none was sought.
    """
    parts = [
        _verdict(diagnosis, next_experiment),
        _localisation(diagnosis),
        _ranking(diagnosis),
        _reduction(diagnosis),
        _remainder(diagnosis),
    ]
    if next_experiment:
        plan = Verdict(status="note", text=next_experiment)
        parts.append(Section(title="Next experiment", verdicts=[plan], blocks=[]))
    return [*parts, _warnings(diagnosis)]


def _verdict(diagnosis: Diagnosis, next_experiment: str) -> Section:
    status, text = verdict_sentence(diagnosis, next_experiment)
    explanation = (
        "The gap is the root mean square of (model - measured)/noise on recordings that were never "
        "fitted to: 1 is noise alone. The nominal model has the parameters as given. The recalibrated "
        "model has its calibrated parameters refitted. With a cause, both are refitted together. "
        f"Intervals hold {level_text(diagnosis)}."
    )
    return Section(
        title="Verdict",
        summary=True,
        verdicts=[Verdict(status=status, text=text)],
        blocks=[calibrated_values(diagnosis, status), Text(text=explanation)],
    )


def _localisation(diagnosis: Diagnosis) -> Section:
    localisation = diagnosis.localisation
    largest = diagnosis.settings.report.heat_map_range
    blocks: list[Block] = [
        Picture(
            figure=localisation_figures.heat_map(localisation.regime_gaps, largest),
            caption="Gap after recalibration, by channel and regime; regimes may overlap.",
        ),
        residual(diagnosis, diagnosis.ranking.recalibrated, "Residual after recalibration"),
        Picture(
            figure=ranking_figures.location_figure(diagnosis),
            caption="Left: the equation or reading in which something is missing, from the residual "
            "alone, whatever the catalogue. Right: the component at fault, from the named causes and "
            "the equations.",
        ),
    ]
    verdicts = [Verdict(status="note", text=sentences.location_sentence(diagnosis))]
    if localisation.missing_term:
        blocks += missing_term(diagnosis, localisation, "The recalibrated model")
    return Section(title="Where the gap lies", verdicts=verdicts, blocks=blocks)


def _ranking(diagnosis: Diagnosis) -> Section:
    ambiguity_set = diagnosis.conclusion.ambiguity_set
    verdicts = [Verdict(status="note", text=sentences.hidden_causes_sentence(diagnosis))]
    if ambiguity_set:
        names = ", ".join(hypothesis_title(cause.hypothesis) for cause in ambiguity_set)
        share = percent(diagnosis.ranking.settings.ambiguity_share)
        text = f"The fewest causes that hold {share} of the probability of all causes: {names}."
        status = "good" if len(ambiguity_set) == 1 else "doubt"
        verdicts.insert(0, Verdict(status=status, text=text))
    blocks: list[Block] = [
        Picture(
            figure=ranking_figures.ranking_figure(diagnosis),
            caption="Probability of each hypothesis; blue: the ambiguity set.",
        )
    ]
    if diagnosis.judged:
        blocks += [
            tables.inclusion_table(diagnosis),
            tables.ranking_table(diagnosis),
            Picture(
                figure=ranking_figures.size_figure(diagnosis),
                caption=f"Fitted sizes with {level_text(diagnosis)} intervals in their physical range.",
            ),
        ]
    return Section(title="Which cause it is", verdicts=verdicts, blocks=blocks)


def _reduction(diagnosis: Diagnosis) -> Section:
    reduction, words = diagnosis.reduction, partial(in_words, diagnosis)
    blocks: list[Block] = [
        Picture(
            figure=reduction_figures.gap_figure(reduction, words),
            caption="Gap of every model on held-out recordings with "
            f"{level_text(diagnosis)} intervals; red: noise alone.",
        )
    ]
    if reduction.shares_closed and diagnosis.conclusion.verdict != NO_GAP:
        blocks.append(
            Picture(
                figure=reduction_figures.share_figure(reduction, words),
                caption="Share that each cause closes of the gap between recalibration and noise.",
            )
        )
    blocks.append(tables.gap_table(diagnosis))
    if diagnosis.best and diagnosis.conclusion.verdict in (KNOWN, AMBIGUOUS):
        best = diagnosis.best.hypothesis
        blocks.append(residual(diagnosis, best, f"Residual with {hypothesis_title(best)}"))
    blocks += [
        Picture(
            figure=ranking_figures.parameter_change_figure(diagnosis),
            caption="Changes of the calibrated parameters: they absorb part of what the model lacks.",
        ),
        tables.parameter_table(diagnosis),
    ]
    return Section(
        title="How far the gap shrinks",
        verdicts=[Verdict(status="note", text=sentences.reduction_sentence(diagnosis))],
        blocks=blocks,
    )


def _remainder(diagnosis: Diagnosis) -> Section:
    """What no named cause explains: how much, where, of which shape, and what is only disturbance."""
    blocks: list[Block] = []
    if diagnosis.remaining and diagnosis.best:
        name = hypothesis_title(diagnosis.best.hypothesis)
        blocks += missing_term(diagnosis, diagnosis.remaining, f"The model with {name}")
        blocks.append(residual(diagnosis, diagnosis.best.hypothesis, f"Residual with {name}"))
    text = remainder_sentence(diagnosis)
    if not diagnosis.remaining:
        text = f"{text} {disturbance_sentence(diagnosis)}".strip()
    return Section(
        title="What remains",
        verdicts=[Verdict(status="note", text=text)],
        blocks=[*blocks, tables.discrepancy_table(diagnosis)],
    )


def _warnings(diagnosis: Diagnosis) -> Section:
    texts = [*diagnosis.warnings, *sentences.parameters_at_bounds(diagnosis)]
    verdicts = [Verdict(status="doubt", text=f"{text}.") for text in texts]
    if not verdicts:
        text = "Every relevant fit has converged, and no fitted parameter is at an end of its range."
        verdicts = [Verdict(status="good", text=text)]
    return Section(title="Warnings", verdicts=verdicts, blocks=[])
