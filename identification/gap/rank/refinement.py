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
from identification.gap.rank.screening import ScreenedCause
from identification.gap.rank.settings import RankingSettings


def recalibrate(
    plant: GreyBox, cache: FitCache | None = None, settings: FitSettings | None = None
) -> tuple[FittingProblem, Estimate]:
    """The nominal model with its calibrated parameters refitted, and the problem with its nuisances.

    Args:
        plant: the model and its recordings.
        cache: runs the fits; None keeps nothing.
        settings: judgement of the fits; None: the defaults.
    """
    cache = cache or FitCache(plant)
    rough = FittingProblem(plant, settings=settings)
    start = rough.start(Hypothesis(causes=()), {})
    calibrated = cache("calibration", lambda: fit(rough, [start]))[0]
    slopes = nuisance_slopes(rough, [calibrated], [np.zeros(len(plant.tolerances))])[0]
    problem = FittingProblem(plant, slopes, settings)
    base = cache("recalibration", lambda: fit(problem, [restarted(calibrated)]))[0]
    return problem, base


def restarted(estimate: Estimate) -> Estimate:
    """The estimate as the start of another fit."""
    return replace(estimate, chi_square=np.inf, converged=False, given_up=False)


def refit_with_causes(
    problem: FittingProblem, base: Estimate, causes: Sequence[ScreenedCause]
) -> list[Estimate]:
    """Each screened cause added to the base and refitted; fits that were given up are left out."""
    starts = []
    for screened in causes:
        cause = screened.cause
        joint = Hypothesis(causes=(*base.hypothesis.causes, cause))
        values = {p.symbol: v for p, v in zip(cause.parameters, screened.values, strict=True)}
        start = problem.start(joint, {**problem.values(base), **values})
        start.run_values[:, : len(base.hypothesis.run_parameters)] = base.run_values
        starts.append(replace(start, slopes=base.slopes))
    return [estimate for estimate in fit(problem, starts, base.chi_square) if not estimate.given_up]


def refine(
    problem: FittingProblem,
    evaluated: list[EvaluatedHypothesis],
    counts: Sequence[int],
    name: str,
    cache: FitCache,
    settings: RankingSettings,
    largest_lag: float = np.inf,
) -> list[EvaluatedHypothesis]:
    """Fit the best hypotheses further, with nuisance slopes taken at each estimate.

    Args:
        problem: readings and settings of the fits.
        evaluated: hypotheses by falling log evidence.
        counts: largest number of hypotheses to refine, round by round.
        name: name of the hypotheses in the journal.
        cache: runs the fits.
        settings: of the evidence.
        largest_lag: log evidence by which the best hypothesis may lead one that is refined.

    Returns:
        All hypotheses by falling log evidence.
    """
    for number, most in enumerate(counts if evaluated else (), start=1):
        best = evaluated[0].log_evidence
        near = [each for each in evaluated[:most] if best - each.log_evidence <= largest_lag]
        estimates = [each.estimate for each in near]
        slopes = nuisance_slopes(problem, estimates, [each.tolerances for each in near])
        starts = [
            replace(restarted(estimate), slopes=own)
            for estimate, own in zip(estimates, slopes, strict=True)
        ]
        fitted = cache(f"{name}: own nuisances, round {number}", partial(fit, problem, starts))
        # A journal keeps no slopes.
        refined = [replace(e, slopes=own) for e, own in zip(fitted, slopes, strict=True)]
        others = evaluated[len(near) :]
        evaluated = by_log_evidence([*evaluate(problem, refined, settings), *others])
    return evaluated


def by_log_evidence(evaluated: Sequence[EvaluatedHypothesis]) -> list[EvaluatedHypothesis]:
    """Hypotheses by falling log evidence, whatever their prior probabilities."""
    return sorted(evaluated, key=lambda each: -each.log_evidence)


def best_fit_of_each(evaluated: Sequence[EvaluatedHypothesis]) -> list[EvaluatedHypothesis]:
    """The best of several fits of the same causes from different starts."""
    best: dict[frozenset[str], EvaluatedHypothesis] = {}
    for each in sorted(evaluated, key=lambda each: each.log_evidence):
        best[frozenset(each.labels)] = each
    return list(best.values())
