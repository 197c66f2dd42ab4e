"""Pictures of the residual and of the missing term, as parts of the page."""

import numpy as np

from identification.gap.diagnosis import Diagnosis
from identification.gap.locate.fault_localisation import Localisation
from identification.gap.locate.regime_gaps import regimes_of
from identification.gap.rank.evidence import EvaluatedHypothesis
from identification.gap.report import localisation_figures
from identification.gap.report.remainder import drawn_term
from identification.report.page import Block, Picture


def missing_term(diagnosis: Diagnosis, localisation: Localisation, model: str) -> list[Block]:
    """The missing term over time, and over a state where one explains it."""
    if not localisation.likeliest.windows:
        return []
    forcing, level = localisation.likeliest, diagnosis.settings.reduction.interval_level
    plant = diagnosis.ranking.problem.plant
    blocks: list[Block] = [
        Picture(
            figure=localisation_figures.forcing_figure(plant, forcing, level),
            caption=f"{model} lacks this term in {forcing.equation.title}: the forcing with which it "
            "meets the recordings.",
        )
    ]
    term = drawn_term(diagnosis, localisation)
    if term:
        picture = localisation_figures.missing_term_figure(term, level)
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
    level = diagnosis.settings.reduction.interval_level
    return Picture(
        figure=localisation_figures.residual_figure(
            problem.plant, run, hypothesis.residuals[run], masks, level
        ),
        caption=f"{name}, on the held-out recording that recalibration misses most. Grey: where "
        f"{level_text(diagnosis)} of the noise lies.",
    )


def level_text(diagnosis: Diagnosis) -> str:
    """Probability within the intervals."""
    return percent(diagnosis.settings.reduction.interval_level)


def percent(share: float) -> str:
    """A share [1] in percent, ready to read."""
    return f"{100 * share:g} %"
