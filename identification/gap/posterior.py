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
from identification.gap.rank.settings import RankingSettings


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
    problem: FittingProblem,
    recalibrated: EvaluatedHypothesis,
    hypotheses: Sequence[EvaluatedHypothesis],
    settings: RankingSettings,
) -> Posterior:
    """Probabilities of hypotheses with causes, of no cause and of an unknown one."""
    every = [recalibrated, *hypotheses]
    best = min(every, key=lambda each: float(np.sum(np.log(np.maximum(each.squares, 1e-300)))))
    discrepancies = channel_discrepancies(problem.plant, best.residuals, settings)
    misfits = np.array([misfit_beyond_noise(each, discrepancies) for each in every])
    misfits = misfits - min(float(np.min(misfits)), 0.0)
    scores = np.array(
        [
            _score(problem, each, (float(misfit), float(misfits[0])), discrepancies, settings)
            for each, misfit in zip(every, misfits, strict=True)
        ]
    )
    scores[0] = _no_cause_score(every, misfits, discrepancies, settings)
    scores[1:] += log_completeness(hypotheses, misfits[1:], settings)
    unknown = _robust(float(misfits[0]), float(misfits[0]), settings) + np.log(settings.prior_unknown)
    weights = softmax([*scores, unknown])[:-1]
    left = _shares_left(misfits, discrepancies, settings)
    credible = credibility(
        left + settings.unseen_misfit / max(float(misfits[0]), settings.least_misfit),
        len({cause.name for cause in problem.plant.causes}),
        settings,
    )
    named = with_hidden_causes(weights[1:] * credible[1:], hypotheses, misfits[1:], scores[1:], settings)
    return Posterior(
        probabilities=named.tolist(),
        no_cause=float(weights[0]),
        unknown=float(max(1.0 - weights[0] - np.sum(named), 0.0)),
        scores=scores[1:].tolist(),
        shares_left=left[1:].tolist(),
        discrepancies=discrepancies,
    )


def _no_cause_score(
    every: Sequence[EvaluatedHypothesis],
    misfits: NDArray,
    discrepancies: Sequence[ChannelDiscrepancy],
    settings: RankingSettings,
) -> float:
    """Log posterior of no cause, but for a constant.

    No cause has no form that could err. So the whole difference to the nearest hypothesis counts, in
    variances of all that remains, and what the floor, known to some percent, cannot be.

    every: no cause and each hypothesis. misfits: of these, (1 + n,) [nats].
    """
    nearest = every[int(np.argmin(misfits))]
    gained = every[0].nuisance_penalty - nearest.nuisance_penalty
    beyond = 0.0
    for own, best, d in zip(every[0].squares, nearest.squares, discrepancies, strict=True):
        gained += float(own - best) / (2.0 * d.mean_square * d.autocorrelation)
        noise = (1.0 + settings.floor_tolerance) * d.floor * d.readings
        beyond += max(float(own) - noise, 0.0) / (2.0 * d.floor * d.inflation)
    credit = settings.no_cause_credit + float(np.log(settings.prior_no_cause))
    return credit + _robust(float(np.min(misfits)), float(misfits[0]), settings) - max(gained, beyond)


def credibility(left: NDArray, causes: int, settings: RankingSettings) -> NDArray:
    """Probability that a hypothesis is right and not merely the nearest of those tried, (n,).

    left: share of the misfit that it leaves, (n,) [1]. causes: number of causes in the catalogue; the
    more are tried, the more a wrong one removes by chance.
    """
    ratio = settings.even_share_causes / max(causes, 1)
    even = min(settings.even_share_left * ratio**settings.even_share_power, settings.largest_even_share)
    return 1.0 / (1.0 + (left / even) ** settings.credibility_slope)


def misfit_beyond_noise(each: EvaluatedHypothesis, discrepancies: Sequence[ChannelDiscrepancy]) -> float:
    """Half the sum of squares beyond the floors, in their variances, and of nuisances [nats]."""
    return each.nuisance_penalty + sum(
        (float(squares) / d.floor - d.readings) / (2.0 * d.inflation)
        for squares, d in zip(each.squares, discrepancies, strict=True)
    )


def _robust(misfit: float, explainable: float, settings: RankingSettings) -> float:
    """Log likelihood of a misfit [nats] by Student's t, but for a constant.

    explainable: misfit of the recalibrated model [nats].
    """
    half = 0.5 * settings.form_readings
    return float(-half * np.log1p(misfit / (half + settings.form_error_share * explainable)))


def _score(
    problem: FittingProblem,
    each: EvaluatedHypothesis,
    misfits: tuple[float, float],
    discrepancies: Sequence[ChannelDiscrepancy],
    settings: RankingSettings,
) -> float:
    """Log posterior of a hypothesis, but for a constant.

    misfits: of the hypothesis and of the recalibrated model, beyond noise [nats].
    """
    count = len(each.labels)
    if count and each.at_bound:
        return -np.inf
    inflation = variance_inflation(each, discrepancies)
    price = each.price(inflation, settings.least_price) if each.labels else 0.0
    return _robust(*misfits, settings) - price + _log_prior(problem, each, settings)


def variance_inflation(each: EvaluatedHypothesis, discrepancies: Sequence[ChannelDiscrepancy]) -> float:
    """Variance of a parameter relative to that under white noise of the channels' size [1], at least 1.

    Noise and discrepancy together count, and readings that are correlated tell less.
    """
    correlations = np.array([d.autocorrelation for d in discrepancies])
    readings = sum(d.readings for d in discrepancies)
    return max(float(np.sum(correlations * each.squares)) / max(readings, 1), 1.0)


def _log_prior(problem: FittingProblem, each: EvaluatedHypothesis, settings: RankingSettings) -> float:
    """Log probability of a set of causes before any data."""
    causes = each.estimate.hypothesis.causes
    if not causes:
        return float(np.log(settings.prior_no_cause))
    total = sum(cause.prior for cause in problem.plant.causes)
    shares = [cause.prior / total for cause in causes]
    priors = settings.prior_by_number
    of_number = priors[min(len(causes), len(priors)) - 1]
    return float(np.log(of_number) + gammaln(len(causes) + 1) + np.sum(np.log(shares)))


def _shares_left(
    misfits: NDArray, discrepancies: Sequence[ChannelDiscrepancy], settings: RankingSettings
) -> NDArray:
    """Share of the misfit of the recalibrated model (first) that each leaves, (n,) [1].

    What the scatter of a sum of squares and of the floor may be, counts as nothing left.
    """
    independent = sum(d.readings / d.inflation for d in discrepancies)
    scatter = 0.5 * settings.floor_scatter * independent + np.sqrt(0.5 * independent)
    return np.maximum(misfits - scatter, 0.0) / max(float(misfits[0]), settings.least_misfit)


def log_completeness(
    hypotheses: Sequence[EvaluatedHypothesis], misfits: NDArray, settings: RankingSettings
) -> NDArray:
    """Log probability that each set of causes lacks none that another set has, (n,) [nats].

    Args:
        hypotheses: sets of causes, n of them.
        misfits: of each beyond noise, (n,) [nats].
        settings: judgement.
    """
    names = _names(hypotheses)
    possible = [not each.at_bound for each in hypotheses]
    reached = np.maximum(misfits, 0.0) + settings.chance_misfit
    shares = np.ones(len(hypotheses))
    for i, own in enumerate(names):
        with_another = [
            reached[j]
            for j, other in enumerate(names)
            if possible[j] and len(other - own) == 1 and reached[j] < reached[i]
        ]
        shares[i] = min(with_another, default=reached[i]) / reached[i]
    odds = (shares / settings.completing_share) ** settings.completing_slope
    return np.where(shares < 1.0, np.log(odds) - np.log1p(odds), 0.0)


def with_hidden_causes(
    probabilities: NDArray,
    hypotheses: Sequence[EvaluatedHypothesis],
    misfits: NDArray,
    scores: NDArray,
    settings: RankingSettings,
) -> NDArray:
    """Probabilities of sets of causes where one more cause may hide in errors of form, (n,).

    A set passes a share on to the sets that were tried with one more cause, by their scores. The sum
    and the probability that a cause of the set is part of the gap stay.

    Args:
        probabilities: of sets of causes, (n,).
        hypotheses: the sets, n of them.
        misfits: of each beyond noise, (n,) [nats].
        scores: log probability of each, but for a constant, (n,) [nats].
        settings: judgement.
    """
    names = _names(hypotheses)
    spread = probabilities.copy()
    for i, own in enumerate(names):
        larger = [
            j
            for j, other in enumerate(names)
            if own < other and len(other) == len(own) + 1 and not hypotheses[j].at_bound
        ]
        if not larger or misfits[i] <= 0.0:
            continue
        share = settings.hidden_share / (1.0 + (settings.hiding_misfit / misfits[i]) ** 2)
        spread[i] -= share * probabilities[i]
        spread[larger] += share * probabilities[i] * softmax(scores[larger])
    return spread


def _names(hypotheses: Sequence[EvaluatedHypothesis]) -> list[frozenset[str]]:
    """Names of the causes of each hypothesis."""
    return [frozenset(cause.name for cause in each.estimate.hypothesis.causes) for each in hypotheses]
