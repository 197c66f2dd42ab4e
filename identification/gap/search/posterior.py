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

POWER = 7.0
"""How many powers of 1 + M/T the likelihood falls by [1]: a cause that leaves 3 T is 130 times less
probable than one that leaves T."""

NO_CAUSE = 0.5
"""Probability before the data of no cause: most valves have no fault or one."""

UNKNOWN = 0.2
"""Probability of an unknown cause relative to the best catalogued one, where both leave as much [1]."""

UNKNOWN_SHARE, LAW_SHARE = 0.1, 0.2
"""Share of the recalibrated model's misfit that the nearest catalogued cause leaves of an unknown one
[1]: a third in amplitude. And how much less it leaves with each open law: laws fit nearly anything."""

EXPECTED_PENALTY = 1.5
"""Half the squared deviation of a law from the assumed one that is usual, of three components [nats]."""


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
    much_is_left: bool
    """Whether that hypothesis leaves more than what no model is free of."""


def posterior(
    problem: FittingProblem,
    recalibrated: EvaluatedHypothesis,
    hypotheses: Sequence[EvaluatedHypothesis],
    predictable: bool = True,
) -> Posterior:
    """Probabilities of hypotheses with causes, of no cause and of an unknown one.

    predictable: whether the inputs foretell what the recalibrated model leaves; if not, no model is free
    of what the best hypothesis leaves.
    """
    every = [recalibrated, *hypotheses]
    best = min(every, key=lambda each: float(np.sum(np.log(np.maximum(each.squares, 1e-300)))))
    noise = residual_noise(problem.plant, best.residuals)
    misfits = np.array([misfit_beyond_noise(each, noise) for each in every])
    misfits -= min(float(np.min(misfits)), 0.0)
    tolerated = tolerated_misfit(sum(own.readings for own in noise))
    much_is_left = bool(np.min(misfits) > tolerated)
    tolerated += 0.0 if predictable else float(np.min(misfits))
    scores = log_likelihoods(misfits, tolerated) + log_priors(problem, hypotheses)
    scores = np.append(scores, log_score_of_unknown(scores, misfits, hypotheses, tolerated))
    weights = softmax(scores)
    order = np.argsort(-scores[1:-1], kind="stable")
    return Posterior(
        hypotheses=[hypotheses[i] for i in order],
        probabilities=weights[1:-1][order].tolist(),
        no_cause=float(weights[0]),
        unknown=float(weights[-1]),
        misfits=misfits[1:][order].tolist(),
        best=best,
        noise=noise,
        much_is_left=much_is_left,
    )


def tolerated_misfit(readings: int) -> float:
    """The misfit that no model is free of [nats].

    Chance leaves 15, however few the readings, as more parameters fit noise as well. 0.002 per reading
    raise the root mean square by a fifth of a percent, which no estimate of the noise resolves.
    """
    return 15.0 + 2e-3 * readings


def log_likelihoods(misfits: NDArray, tolerated: float) -> NDArray:
    """Of misfits (n,) or () [nats] where the variance of the model's discrepancy is unknown, (n,)."""
    return -POWER * np.log1p(misfits / tolerated)


def log_priors(problem: FittingProblem, hypotheses: Sequence[EvaluatedHypothesis]) -> NDArray:
    """Log probability before the data of no cause and of hypotheses, (1 + n,).

    All sets of as many causes share the probability of their number, and an open law that of all states
    that it may follow. A size at an end of its range costs 1 nat.
    """
    return np.array([np.log(NO_CAUSE), *(_log_prior(problem, each) for each in hypotheses)])


def _log_prior(problem: FittingProblem, each: EvaluatedHypothesis) -> float:
    hypothesis = each.estimate.hypothesis
    arguments = max(len(getattr(problem.plant, "law_arguments", ())), 1)
    count, chosen = len({cause.name for cause in problem.plant.causes}), len(each.labels)
    sets = gammaln(count + 1) - gammaln(chosen + 1) - gammaln(count - chosen + 1)
    # One cause is taken to act in three of ten plants; each further one is ten times rarer.
    number = np.log(0.3) + (chosen - 1) * np.log(0.1) - sets
    variants = sum(np.log(cause.prior) for cause in hypothesis.causes)
    laws = each.law_penalty + len(hypothesis.laws) * np.log(arguments)
    # Sizes that are fitted fit noise as well (Schwarz 1978).
    sizes = 0.5 * np.log(max(problem.readings, 1)) * sum(len(c.sizes) for c in hypothesis.causes)
    return float(number + variants - laws - sizes - each.unusual)


def log_score_of_unknown(
    scores: NDArray, misfits: NDArray, hypotheses: Sequence[EvaluatedHypothesis], tolerated: float
) -> float:
    """That of an unknown cause: as complex as the best set of causes, with usual laws and sizes.

    It leaves as much as the nearest wrong set of causes usually does: less with each open law. The set's
    most credible variant counts, whatever laws improve it further.

    scores, misfits: of no cause, then of the hypotheses, (1 + n,).
    """
    if not hypotheses:
        return -np.inf
    best = int(np.argmax(scores[1:]))

    def log_odds(each: EvaluatedHypothesis, misfit: float) -> float:
        laws = len(each.estimate.hypothesis.laws)
        wild = max(each.law_penalty - EXPECTED_PENALTY * laws, 0.0) + each.unusual
        left = np.array([UNKNOWN_SHARE * LAW_SHARE**laws * misfits[0], misfit])
        of_unknown, own = log_likelihoods(left, tolerated)
        return float(np.log(UNKNOWN) + wild + of_unknown - own)

    return float(scores[1 + best]) + min(
        log_odds(each, misfit)
        for each, misfit in zip(hypotheses, misfits[1:], strict=True)
        if set(each.labels) == set(hypotheses[best].labels)
    )


def misfit_beyond_noise(each: EvaluatedHypothesis, noise: Sequence[ChannelNoise]) -> float:
    """Half the sum of squares beyond the floors, in their variances, and of nuisances [nats]."""
    return each.nuisance_penalty + sum(
        (float(squares) / own.floor - own.readings) / 2.0
        for squares, own in zip(each.squares, noise, strict=True)
    )
