"""Recalibration, refits beside a base, and the noise that the recalibrated model's residuals show.

A judgement must not hinge on the noise that somebody states: fits would end too early or too late, and
channels would have wrong weights.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from identification.gap.discrepancy import LAGS, ChannelDiscrepancy, noise_ratios, squared_differences
from identification.gap.evidence import EvaluatedHypothesis, evaluate, misfit
from identification.gap.fitting_problem import Estimate, FitCache, FittingProblem, Hypothesis
from identification.gap.form_modes import form_modes
from identification.gap.gauss_newton import fit, nuisance_slopes
from identification.gap.plant import GreyBox
from identification.gap.prediction import predict
from identification.gap.prepared_plant import PreparedPlant, prepared
from identification.gap.screening import Start

ROUNDS, ITERATIONS_OF_A_ROUND = 2, 4
"""Rounds in which the modes of form are taken anew, as they change with the estimate, and most steps
in between."""

WRONG_NOISE_RATIO = 1.25
"""Ratio of the noise that the residuals show to the stated noise, or its inverse, above which the stated
noise is corrected [1]: less changes no judgement."""


def recalibrate(
    plant: GreyBox, cache: FitCache | None = None, *, thorough: bool = False, prefix: str = ""
) -> tuple[FittingProblem, Estimate]:
    """The nominal model with its calibrated parameters refitted, and the problem with its nuisances.

    Args:
        plant: the model and its recordings.
        cache: runs the fits; None keeps nothing.
        thorough: whether fits go on until little is left to gain, as a small catalogue allows.
        prefix: of the names of both fits in the journal.
    """
    cache = cache or FitCache(plant)
    rough = FittingProblem(plant, thorough=thorough)
    start = rough.start(Hypothesis(causes=()), {})
    calibrated = cache(f"{prefix}calibration", lambda: fit(rough, [start]))[0]
    slopes = nuisance_slopes(rough, [calibrated], [np.zeros(len(plant.tolerances))])[0]
    problem = FittingProblem(plant, slopes, thorough=thorough)
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
    problem: FittingProblem, evaluated: Sequence[EvaluatedHypothesis], name: str, cache: FitCache
) -> list[EvaluatedHypothesis]:
    """Hypotheses fitted further, with nuisance slopes taken at each estimate; name: in the journal."""
    if not evaluated:
        return []
    best = list(evaluated)
    slopes = nuisance_slopes(
        problem, [each.estimate for each in evaluated], [each.tolerances for each in evaluated]
    )
    for round_ in range(ROUNDS):
        slopes = [
            replace(own, forms=form_modes(problem, replace(each.estimate, slopes=own)))
            for own, each in zip(slopes, evaluated, strict=True)
        ]
        starts = [
            replace(restarted(each.estimate), slopes=own)
            for each, own in zip(evaluated, slopes, strict=True)
        ]
        another = partial(fit, problem, starts, iterations=ITERATIONS_OF_A_ROUND)
        fitted = cache(f"{name}, round {round_ + 1}", another)
        # A journal keeps no slopes.
        refined = [replace(e, slopes=own) for e, own in zip(fitted, slopes, strict=True)]
        evaluated = evaluate(problem, refined)
        pairs = zip(best, evaluated, strict=True)
        best = [new if round_ == 0 or misfit(new) < misfit(old) else old for old, new in pairs]
    return best


def with_seen_noise(problem: FittingProblem, base: Estimate) -> PreparedPlant:
    """The plant with the noise that the residuals show; the same object where that is near the stated.

    problem: readings weighted by the stated noise. base: the recalibrated model.
    """
    plant = prepared(problem.plant)
    residuals = predict(problem, base).residuals
    squares = np.sum([np.sum(r**2, axis=1) for r in residuals], axis=0)
    counts = np.sum([np.sum(run.trusted, axis=1) for run in plant.runs], axis=0)
    variograms = []
    for lag in LAGS:
        changes, kept = squared_differences(plant, residuals, lag)
        total = np.sum([np.sum(change, axis=1) for change in changes], axis=0)
        number = np.sum([np.sum(keep, axis=1) for keep in kept], axis=0)
        variograms.append(0.5 * total / np.maximum(number, 1))
    mean_squares = squares / np.maximum(counts, 1)
    ratios = noise_ratios(np.array(variograms)[:, None], mean_squares[None])[0]
    wrong = (ratios > WRONG_NOISE_RATIO) | (ratios < 1.0 / WRONG_NOISE_RATIO)
    if not np.any(wrong):
        return plant
    return plant.with_noise(np.where(wrong, ratios, 1.0).tolist())


def with_disturbance(plant: PreparedPlant, discrepancies: Sequence[ChannelDiscrepancy]) -> PreparedPlant:
    """The plant whose disturbed channels weigh as much as they tell; the same object where none is.

    Readings under a slow disturbance do not err independently: n of them tell as much as n/inflation.
    Weighted as white noise, such a channel would pull the parameters after its disturbance.

    plant: with the noise that the readings show. discrepancies: under the best hypothesis.
    """
    ratios = [np.sqrt(d.floor * d.inflation) if d.inflation > 1.0 else 1.0 for d in discrepancies]
    if max(ratios) <= WRONG_NOISE_RATIO:
        return plant
    return plant.with_noise([max(float(ratio), 1.0) for ratio in ratios])
