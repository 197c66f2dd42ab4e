"""Recalibration, refits beside a base, and the noise that the recalibrated model's residuals show.

A judgement must not hinge on the noise that somebody states: fits would end too early or too late, and
channels would have wrong weights.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.gap.fit.evidence import EvaluatedHypothesis, evaluate, predict
from identification.gap.fit.fitting_problem import Estimate, FitCache, FittingProblem, Hypothesis
from identification.gap.fit.gauss_newton import fit, nuisance_slopes
from identification.gap.plant import GreyBox
from identification.gap.prepare.noise import ChannelNoise, raw_noise_ratio
from identification.gap.prepare.prepared_plant import PreparedPlant, prepared
from identification.noise import white_noise

WRONG_NOISE_RATIO = 1.25
"""Ratio of the noise that the residuals show to the stated noise, or its inverse, above which the stated
noise is corrected [1]: less changes no judgement."""


def recalibrate(
    plant: GreyBox,
    cache: FitCache | None = None,
    prefix: str = "",
    *,
    start: Mapping[str, float] | None = None,
    iterations: int = 20,
    precision: float = 1.0,
) -> tuple[FittingProblem, Estimate]:
    """The nominal model with its calibrated parameters refitted, and the problem with its nuisances.

    Args:
        plant: the model and its recordings.
        cache: runs the fits; None keeps nothing.
        prefix: of the names of both fits in the journal.
        start: values by symbol [SI] where the fit begins; those left out, and None: nominal.
        iterations: most of each of the two fits.
        precision: of `fit` [1].
    """

    def fitted(problem: FittingProblem, begun: Estimate) -> list[Estimate]:
        return fit(problem, [begun], iterations=iterations, precision=precision)

    cache = cache or FitCache(plant)
    rough = FittingProblem(plant)
    first = rough.start(Hypothesis(causes=()), start or {})
    calibrated = cache(f"{prefix}calibration", lambda: fitted(rough, first))[0]
    slopes = nuisance_slopes(rough, [calibrated], [np.zeros(len(plant.tolerances))])[0]
    problem = FittingProblem(plant, slopes)
    fits = cache(
        f"{prefix}recalibration", lambda: fitted(problem, restarted(calibrated)), problem.slopes_of
    )
    return problem, fits[0]


def restarted(estimate: Estimate) -> Estimate:
    """The estimate as the start of another fit."""
    return replace(estimate, chi_square=np.inf, converged=False, given_up=False)


def with_own_nuisances(
    problem: FittingProblem, evaluated: Sequence[EvaluatedHypothesis], name: str, cache: FitCache
) -> list[EvaluatedHypothesis]:
    """Hypotheses fitted further, with nuisance slopes taken at each estimate; name: in the journal."""
    if not evaluated:
        return []
    slopes = nuisance_slopes(
        problem, [each.estimate for each in evaluated], [each.tolerances for each in evaluated]
    )
    starts = [
        replace(restarted(each.estimate), slopes=own)
        for each, own in zip(evaluated, slopes, strict=True)
    ]
    fitted = cache(name, lambda: fit(problem, starts))
    # A journal keeps no slopes.
    return evaluate(problem, [replace(e, slopes=own) for e, own in zip(fitted, slopes, strict=True)])


def with_seen_noise(problem: FittingProblem, base: Estimate) -> PreparedPlant:
    """The plant with the noise that the residuals show; the same object where that is near the stated.

    problem: readings weighted by the stated noise. base: the recalibrated model.
    """
    plant = prepared(problem.plant)
    residuals = predict(problem, base).residuals
    ratios = []
    for c in range(len(plant.channels)):
        series = [r[c][run.trusted[c]] for r, run in zip(residuals, plant.runs, strict=True)]
        seen = min(white_noise(series), raw_noise_ratio(plant, c))
        right = not seen > 0 or 1.0 / WRONG_NOISE_RATIO <= seen <= WRONG_NOISE_RATIO
        ratios.append(1.0 if right else seen)
    return plant if max(ratios) == min(ratios) == 1.0 else plant.with_noise(ratios)


def with_ripple(
    plant: PreparedPlant, noise: Sequence[ChannelNoise], foreseen: Sequence[float]
) -> PreparedPlant:
    """The plant whose rippling channels are filtered; the same object where none ripples.

    noise: by channel under the best hypothesis. foreseen: share of its held-out squares that a black box
    predicts, by channel [1]; what a model of the inputs foresees is a misfit, no ripple.
    """
    # By chance a fifth of correlated readings may be foreseen.
    ripples = tuple(
        own.ripple if share < 0.2 else None for own, share in zip(noise, foreseen, strict=True)
    )
    return plant.with_ripples(ripples) if any(ripples) else plant
