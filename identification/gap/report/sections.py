"""What a diagnosis found, for the HTML page."""

import numpy as np

from identification.gap.diagnosis import Diagnosis, label
from identification.gap.locate.fault_localisation import Where
from identification.gap.locate.forcing import candidate
from identification.gap.rank.evidence import Assessed
from identification.gap.rank.verdict import AMBIGUOUS, KNOWN, NO_GAP
from identification.gap.report import localisation_figures as where_figures
from identification.gap.report import ranking_figures as which_figures
from identification.gap.report import reduction_figures as shrink_figures
from identification.gap.report import sentences
from identification.gap.report import tables as section_tables
from identification.report.page import Block, Picture, Section, Text, Verdict

READING = (
    "The gap is the root mean square of (model - measured)/noise on recordings that were never fitted "
    "to: 1 is noise alone. Nominal, recalibrated, with cause: the model as given, with its calibrated "
    "parameters refitted, and with these and the cause refitted together. Intervals hold 90 %."
)

TELLING = 0.2
"""Share of the missing term that a state must tell for the term to be drawn over it."""


def sections(diagnosis: Diagnosis, next_experiment: str = "") -> list[Section]:
    """The whole report: verdict, where, which, how far it shrinks, next experiment, warnings.

    next_experiment: a sentence or two; empty where none was sought.
    """
    status, text = sentences.verdict(diagnosis, next_experiment)
    found = [
        Section(
            title="Verdict",
            verdicts=[Verdict(status=status, text=text)],
            blocks=[Text(text=READING)],
        ),
        _where(diagnosis),
        _which(diagnosis),
        _shrink(diagnosis),
    ]
    if next_experiment:
        plan = Verdict(status="note", text=next_experiment)
        found.append(Section(title="Next experiment", verdicts=[plan], blocks=[]))
    return [*found, _warnings(diagnosis)]


def _where(diagnosis: Diagnosis) -> Section:
    where = diagnosis.where
    blocks: list[Block] = [
        Picture(
            figure=where_figures.heat_map(where.regimes),
            caption="What recalibration leaves, by channel and regime; regimes may overlap.",
        ),
        _residual(diagnosis, diagnosis.verdicts.none, "What recalibration leaves over time"),
        Picture(
            figure=which_figures.places(diagnosis),
            caption="Left: which equation or reading lacks something, from the residual alone, whatever "
            "the catalogue. Right: components, as the named causes and the equations have them.",
        ),
    ]
    verdicts = [Verdict(status="note", text=sentences.located(diagnosis))]
    if where.shape:
        blocks += _missing(diagnosis, where, "recalibration")
    if diagnosis.left and diagnosis.left.shape:
        verdicts.append(Verdict(status="note", text=sentences.beside(diagnosis, diagnosis.left)))
        blocks += _missing(diagnosis, diagnosis.left, "even the nearest cause")
    return Section(title="Where the gap lies", verdicts=verdicts, blocks=blocks)


def _missing(diagnosis: Diagnosis, where: Where, model: str) -> list[Block]:
    """The missing term over time, and over a state where one tells it."""
    likeliest = max(where.forcings, key=lambda forcing: where.equation[forcing.equation.name])
    found: list[Block] = [
        Picture(
            figure=where_figures.forcing_figure(diagnosis.verdicts.fitter.plant, likeliest),
            caption=f"What {model} leaves out: the least that {likeliest.equation.name} needs to meet "
            "the recordings.",
        )
    ]
    if where.shape and where.shape.explained >= TELLING:
        picture = where_figures.shape_figure(where.shape)
        found.append(Picture(figure=picture, caption="Its shape, over the state that tells it best."))
    return found


def _residual(diagnosis: Diagnosis, found: Assessed, what: str) -> Picture:
    """Of the held-out run that recalibration misses most."""
    fitter, before = diagnosis.verdicts.fitter, diagnosis.verdicts.none.residuals
    held_out = [r for r, run in enumerate(fitter.plant.runs) if run.held_out]
    run = max(held_out, key=lambda r: np.mean(before[r] ** 2))
    masks = fitter.plant.regimes(candidate(fitter, found.point), run)
    return Picture(
        figure=where_figures.residual_figure(fitter.plant, run, found.residuals[run], masks),
        caption=f"{what}, on the held-out recording that recalibration misses most. Grey: where 90 % of "
        "the noise lies.",
    )


def _which(diagnosis: Diagnosis) -> Section:
    ambiguity = diagnosis.conclusion.ambiguity
    verdicts = [Verdict(status="note", text=sentences.hidden(diagnosis))]
    if ambiguity:
        names = ", ".join(label(cause.found) for cause in ambiguity)
        text = f"The fewest causes that hold 90 % of the probability of all causes: {names}."
        verdicts.insert(0, Verdict(status="good" if len(ambiguity) == 1 else "doubt", text=text))
    blocks: list[Block] = [
        Picture(
            figure=which_figures.ranking(diagnosis),
            caption="Probability of each hypothesis; blue: the ambiguity set.",
        )
    ]
    if diagnosis.judged:
        blocks += [
            section_tables.ranking(diagnosis),
            Picture(
                figure=which_figures.sizes(diagnosis.judged),
                caption="Fitted sizes with 90 % intervals in their physical range.",
            ),
        ]
    return Section(title="Which cause it is", verdicts=verdicts, blocks=blocks)


def _shrink(diagnosis: Diagnosis) -> Section:
    blocks: list[Block] = [
        Picture(
            figure=shrink_figures.gaps(diagnosis.shrinkage),
            caption="Gap of every model on held-out recordings with 90 % intervals; red: noise alone.",
        )
    ]
    if diagnosis.shrinkage.shrink and diagnosis.conclusion.verdict != NO_GAP:
        blocks.append(
            Picture(
                figure=shrink_figures.shares(diagnosis.shrinkage),
                caption="What each cause closes of the gap above noise that recalibration leaves.",
            )
        )
    blocks.append(section_tables.gaps(diagnosis))
    if diagnosis.best and diagnosis.conclusion.verdict in (KNOWN, AMBIGUOUS):
        name = label(diagnosis.best.found)
        blocks.append(_residual(diagnosis, diagnosis.best.found, f"What is left with {name}"))
    blocks += [
        Picture(
            figure=which_figures.moves(diagnosis),
            caption="How the calibrated parameters moved: they take up part of what the model lacks.",
        ),
        section_tables.parameters(diagnosis),
    ]
    return Section(
        title="How far the gap shrinks",
        verdicts=[Verdict(status="note", text=sentences.shrunk(diagnosis))],
        blocks=blocks,
    )


def _warnings(diagnosis: Diagnosis) -> Section:
    found = [*diagnosis.warnings, *sentences.ends(diagnosis)]
    verdicts = [Verdict(status="doubt", text=f"{text}.") for text in found]
    if not verdicts:
        text = "Every fit that counts has converged, and no number of it is at an end of its range."
        verdicts = [Verdict(status="good", text=text)]
    return Section(title="Warnings", verdicts=verdicts, blocks=[])
