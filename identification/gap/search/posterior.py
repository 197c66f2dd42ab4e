"""Probabilities of hypotheses, all on one scale: the misfit that each leaves beyond noise.

A hypothesis is a set of causes with their laws, no cause, or an unknown one. Its misfit M is half its
sum of squares beyond the noise floors, with the penalties of nuisance parameters. Where the variance of
the model's discrepancy is unknown, the likelihood is a power of the misfit (Student's t): the log
probability is -POWER log(1 + M/T) + log prior. T is the misfit that no model is free of. The prior
counts causes and open laws, and how far the laws depart from those that are assumed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, softmax

from identification.gap.fit.evidence import EvaluatedHypothesis
from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.prepare.noise import ChannelNoise, residual_noise

POWER = 10.0
"""How many powers of 1 + M/T the likelihood falls by [1]: a cause that leaves 2 T is 60 times less
probable than one that leaves T."""

NO_CAUSE = 0.5
"""Probability before the data of no cause: most valves have no fault or one."""

UNKNOWN_SHARE = 3e-3
"""Share of the recalibrated model's misfit that an unknown cause is taken to leave [1], beside the
tolerated one: 5 % in amplitude, which a wrong cause rarely reaches."""


@dataclass(frozen=True, kw_only=True)
class Posterior:
    """Probabilities of n hypotheses with causes, and of the others."""

    hypotheses: list[EvaluatedHypothesis]
    """Single causes and sets of causes, the most probable first, (n,)."""
    probabilities: list[float]
    """Of each hypothesis, (n,); with the two following they sum to 1."""
    no_cause: float
    """Probability that no cause acts."""
    unknown: float
    """Probability that what acts has no name in the catalogue."""
    misfits: list[float]
    """Misfit beyond noise that each hypothesis leaves, (n,) [nats]."""
    best: EvaluatedHypothesis
    """The hypothesis, or the model without a cause, that leaves the least; it shows the noise."""
    noise: list[ChannelNoise]
    """Noise of each channel under it."""


def posterior(
    problem: FittingProblem, recalibrated: EvaluatedHypothesis, hypotheses: Sequence[EvaluatedHypothesis]
) -> Posterior:
    """Probabilities of hypotheses with causes, of no cause and of an unknown one."""
    every = [recalibrated, *hypotheses]
    best = min(every, key=lambda each: float(np.sum(np.log(np.maximum(each.squares, 1e-300)))))
    noise = residual_noise(problem.plant, best.residuals)
    misfits = np.array([misfit_beyond_noise(each, noise) for each in every])
    misfits = misfits - min(float(np.min(misfits)), 0.0)
    readings = sum(own.readings for own in noise)
    left = np.append(misfits, tolerated_misfit(readings) + UNKNOWN_SHARE * misfits[0])
    scores = log_likelihoods(left, readings) + log_priors(problem, hypotheses)
    weights = softmax(scores)
    order = np.lexsort((misfits[1:], -weights[1:-1]))
    return Posterior(
        hypotheses=[hypotheses[i] for i in order],
        probabilities=weights[1:-1][order].tolist(),
        no_cause=float(weights[0]),
        unknown=float(weights[-1]),
        misfits=misfits[1:][order].tolist(),
        best=best,
        noise=noise,
    )


def tolerated_misfit(readings: int) -> float:
    """The misfit that no model is free of [nats].

    Chance leaves 15, however few the readings, as more parameters fit noise as well. 0.002 per reading
    raise the root mean square by a fifth of a percent, which no estimate of the noise resolves.
    """
    return 15.0 + 2e-3 * readings


def log_likelihoods(misfits: NDArray, readings: int) -> NDArray:
    """Of misfits (n,) [nats] where the variance of the model's discrepancy is unknown, (n,)."""
    return -POWER * np.log1p(misfits / tolerated_misfit(readings))


def log_priors(problem: FittingProblem, hypotheses: Sequence[EvaluatedHypothesis]) -> NDArray:
    """Log probability before the data of no cause, of hypotheses and of an unknown cause, (n + 2,).

    All sets of as many causes share the probability of their number, and an open law that of all states
    that it may follow. A size at an end of its range costs 1 nat. An unknown cause is as probable as two
    causes.
    """
    arguments = max(len(getattr(problem.plant, "law_arguments", ())), 1)
    count = len({cause.name for cause in problem.plant.causes})
    chosen = np.array([*(len(each.labels) for each in hypotheses), min(2, count)])
    sets = gammaln(count + 1) - gammaln(chosen + 1) - gammaln(count - chosen + 1)
    # One cause is taken to act in three of ten plants; each further one is ten times rarer.
    logs = np.log(0.3) + (chosen - 1) * np.log(0.1) - sets
    own = [sum(np.log(c.prior) for c in each.estimate.hypothesis.causes) for each in hypotheses]
    laws = [
        each.law_penalty + len(each.estimate.hypothesis.laws) * np.log(arguments) + each.unusual
        for each in hypotheses
    ]
    sizes = [sum(len(c.sizes) for c in each.estimate.hypothesis.causes) for each in hypotheses]
    # Sizes that are fitted fit noise as well (Schwarz 1978); an unknown cause has two.
    fitted = 0.5 * np.log(max(problem.readings, 1)) * np.array([*sizes, 2.0])
    logs = logs - fitted
    return np.array([np.log(NO_CAUSE), *(logs[:-1] + own - np.array(laws)), logs[-1]])


def misfit_beyond_noise(each: EvaluatedHypothesis, noise: Sequence[ChannelNoise]) -> float:
    """Half the sum of squares beyond the floors, in their variances, and of nuisances [nats]."""
    return each.nuisance_penalty + sum(
        (float(squares) / own.floor - own.readings) / 2.0
        for squares, own in zip(each.squares, noise, strict=True)
    )


def variance_inflation(each: EvaluatedHypothesis, noise: Sequence[ChannelNoise]) -> float:
    """Variance of a parameter relative to that under white noise of the channels' size [1], at least 1.

    Noise and discrepancy together count, and readings that are correlated tell less.
    """
    correlations = np.array([own.correlated for own in noise])
    readings = sum(own.readings for own in noise)
    return max(float(np.sum(correlations * each.squares)) / max(readings, 1), 1.0)
