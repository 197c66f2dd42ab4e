"""The report of a diagnosis as sections of the HTML page."""

import numpy as np

from identification.gap.diagnosis import Diagnosis, hypothesis_label
from identification.gap.locate.fault_localisation import Localisation
from identification.gap.locate.regime_gaps import regimes_of
from identification.gap.rank.evidence import EvaluatedHypothesis
from identification.gap.rank.verdict import AMBIGUOUS, KNOWN, NO_GAP
from identification.gap.report import (
    localisation_figures,
    ranking_figures,
    reduction_figures,
    sentences,
    tables,
)
from identification.gap.report.verdict_sentences import verdict_sentence
from identification.report.page import Block, Picture, Section, Text, Verdict


def sections(diagnosis: Diagnosis, next_experiment: str = "") -> list[Section]:
    """The whole report: verdict, localisation, ranking, reduction, next experiment, warnings.

    next_experiment: a sentence or two; empty where none was sought.
    """
    parts = [
        _verdict(diagnosis, next_experiment),
        _localisation(diagnosis),
        _ranking(diagnosis),
        _reduction(diagnosis),
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
        f"Intervals hold {_level(diagnosis)}."
    )
    return Section(
        title="Verdict",
        verdicts=[Verdict(status=status, text=text)],
        blocks=[Text(text=explanation)],
    )


def _localisation(diagnosis: Diagnosis) -> Section:
    localisation = diagnosis.localisation
    largest = diagnosis.settings.report.heat_map_range
    blocks: list[Block] = [
        Picture(
            figure=localisation_figures.heat_map(localisation.regime_gaps, largest),
            caption="Gap after recalibration, by channel and regime; regimes may overlap.",
        ),
        _residual(diagnosis, diagnosis.ranking.recalibrated, "Residual after recalibration"),
        Picture(
            figure=ranking_figures.location_figure(diagnosis),
            caption="Left: the equation or reading in which something is missing, from the residual "
            "alone, whatever the catalogue. Right: the component at fault, from the named causes and "
            "the equations.",
        ),
    ]
    verdicts = [Verdict(status="note", text=sentences.location_sentence(diagnosis))]
    if localisation.missing_term:
        blocks += _missing_term(diagnosis, localisation, "The recalibrated model")
    remaining = diagnosis.remaining
    if remaining and remaining.missing_term:
        text = sentences.remaining_sentence(diagnosis, remaining)
        verdicts.append(Verdict(status="note", text=text))
        blocks += _missing_term(diagnosis, remaining, "The model with the nearest cause")
    return Section(title="Where the gap lies", verdicts=verdicts, blocks=blocks)


def _missing_term(diagnosis: Diagnosis, localisation: Localisation, model: str) -> list[Block]:
    """The missing term over time, and over a state where one explains it."""
    forcing, level = localisation.likeliest, diagnosis.settings.reduction.interval_level
    plant = diagnosis.ranking.problem.plant
    blocks: list[Block] = [
        Picture(
            figure=localisation_figures.forcing_figure(plant, forcing, level),
            caption=f"{model} lacks this term in {forcing.equation.name}: the forcing with which it "
            "meets the recordings.",
        )
    ]
    term, least = localisation.missing_term, diagnosis.settings.report.drawn_term_share
    if term and term.explained >= least:
        picture = localisation_figures.missing_term_figure(term, level)
        caption = "The missing term over the state that explains it best."
        blocks.append(Picture(figure=picture, caption=caption))
    return blocks


def _residual(diagnosis: Diagnosis, hypothesis: EvaluatedHypothesis, name: str) -> Picture:
    """Residual of the held-out run that recalibration misses most."""
    problem = diagnosis.ranking.problem
    recalibrated = diagnosis.ranking.recalibrated.residuals
    held_out = [r for r, run in enumerate(problem.plant.runs) if run.held_out]
    run = max(held_out, key=lambda r: np.mean(recalibrated[r] ** 2))
    masks = regimes_of(problem.plant, problem.candidate(hypothesis.estimate), run)
    level = diagnosis.settings.reduction.interval_level
    return Picture(
        figure=localisation_figures.residual_figure(
            problem.plant, run, hypothesis.residuals[run], masks, level
        ),
        caption=f"{name}, on the held-out recording that recalibration misses most. Grey: where "
        f"{_level(diagnosis)} of the noise lies.",
    )


def _ranking(diagnosis: Diagnosis) -> Section:
    ambiguity_set = diagnosis.conclusion.ambiguity_set
    verdicts = [Verdict(status="note", text=sentences.hidden_causes_sentence(diagnosis))]
    if ambiguity_set:
        names = ", ".join(hypothesis_label(cause.hypothesis) for cause in ambiguity_set)
        share = _percent(diagnosis.ranking.settings.ambiguity_share)
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
            tables.ranking_table(diagnosis),
            Picture(
                figure=ranking_figures.size_figure(diagnosis),
                caption=f"Fitted sizes with {_level(diagnosis)} intervals in their physical range.",
            ),
        ]
    return Section(title="Which cause it is", verdicts=verdicts, blocks=blocks)


def _reduction(diagnosis: Diagnosis) -> Section:
    reduction = diagnosis.reduction
    blocks: list[Block] = [
        Picture(
            figure=reduction_figures.gap_figure(reduction),
            caption="Gap of every model on held-out recordings with "
            f"{_level(diagnosis)} intervals; red: noise alone.",
        )
    ]
    if reduction.shares_closed and diagnosis.conclusion.verdict != NO_GAP:
        blocks.append(
            Picture(
                figure=reduction_figures.share_figure(reduction),
                caption="Share that each cause closes of the gap between recalibration and noise.",
            )
        )
    blocks.append(tables.gap_table(diagnosis))
    if diagnosis.best and diagnosis.conclusion.verdict in (KNOWN, AMBIGUOUS):
        best = diagnosis.best.hypothesis
        blocks.append(_residual(diagnosis, best, f"Residual with {hypothesis_label(best)}"))
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


def _warnings(diagnosis: Diagnosis) -> Section:
    texts = [*diagnosis.warnings, *sentences.parameters_at_bounds(diagnosis)]
    verdicts = [Verdict(status="doubt", text=f"{text}.") for text in texts]
    if not verdicts:
        text = "Every relevant fit has converged, and no fitted parameter is at an end of its range."
        verdicts = [Verdict(status="good", text=text)]
    return Section(title="Warnings", verdicts=verdicts, blocks=[])


def _level(diagnosis: Diagnosis) -> str:
    """Probability within the intervals."""
    return _percent(diagnosis.settings.reduction.interval_level)


def _percent(share: float) -> str:
    return f"{100 * share:g} %"
