"""Refits of hypotheses: recalibration, causes added to a base, and finalists refined."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from identification.gap.fit.fit_cache import FitCache
from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.gauss_newton import fit
from identification.gap.fit.hypothesis import Estimate, Hypothesis
from identification.gap.fit.linearisation import nuisance_slopes
from identification.gap.fit.settings import FitSettings
from identification.gap.model.grey_box import GreyBox
from identification.gap.rank.evidence import EvaluatedHypothesis, evaluate
from identification.gap.rank.screening import Start
from identification.gap.rank.settings import RankingSettings


def recalibrate(
    plant: GreyBox,
    cache: FitCache | None = None,
    settings: FitSettings | None = None,
    prefix: str = "",
) -> tuple[FittingProblem, Estimate]:
    """The nominal model with its calibrated parameters refitted, and the problem with its nuisances.

    Args:
        plant: the model and its recordings.
        cache: runs the fits; None keeps nothing.
        settings: judgement of the fits; None: the defaults.
        prefix: of the names of both fits in the journal.
    """
    cache = cache or FitCache(plant)
    rough = FittingProblem(plant, settings=settings)
    start = rough.start(Hypothesis(causes=()), {})
    calibrated = cache(f"{prefix}calibration", lambda: fit(rough, [start]))[0]
    slopes = nuisance_slopes(rough, [calibrated], [np.zeros(len(plant.tolerances))])[0]
    problem = FittingProblem(plant, slopes, settings)
    base = cache(f"{prefix}recalibration", lambda: fit(problem, [restarted(calibrated)]))[0]
    return problem, base


def restarted(estimate: Estimate) -> Estimate:
    """The estimate as the start of another fit."""
    return replace(estimate, chi_square=np.inf, converged=False, given_up=False)


def refit(problem: FittingProblem, base: Estimate, starts: Sequence[Start]) -> list[Estimate]:
    """Fits from starts beside a base; those that were given up are left out."""
    fitted = fit(problem, [start.estimate for start in starts], base.chi_square)
    return [estimate for estimate in fitted if not estimate.given_up]


def with_own_nuisances(
    problem: FittingProblem,
    evaluated: Sequence[EvaluatedHypothesis],
    name: str,
    cache: FitCache,
    settings: RankingSettings,
) -> list[EvaluatedHypothesis]:
    """Hypotheses fitted further, with nuisance slopes taken at each estimate.

    Args:
        problem: readings and settings of the fits.
        evaluated: the hypotheses.
        name: of this step in the journal.
        cache: runs the fits.
        settings: of the evaluation.
    """
    if not evaluated:
        return []
    estimates = [each.estimate for each in evaluated]
    slopes = nuisance_slopes(problem, estimates, [each.tolerances for each in evaluated])
    starts = [
        replace(restarted(estimate), slopes=own) for estimate, own in zip(estimates, slopes, strict=True)
    ]
    fitted = cache(name, partial(fit, problem, starts))
    # A journal keeps no slopes.
    refined = [replace(e, slopes=own) for e, own in zip(fitted, slopes, strict=True)]
    return evaluate(problem, refined, settings)
