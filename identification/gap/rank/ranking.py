"""Ranking of hypotheses: screening, joint refits of single causes and pairs, probabilities."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import softmax

from identification.gap.fit.fit_cache import FitCache
from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.linearisation import linearise
from identification.gap.fit.settings import FitSettings
from identification.gap.model.grey_box import GreyBox
from identification.gap.rank.cause_pairs import (
    ResidualScale,
    fit_pairs,
    limit_pair_odds,
    refit_members_of_best_pair,
)
from identification.gap.rank.evidence import EvaluatedHypothesis, evaluate, evaluate_linearised
from identification.gap.rank.misfit import variance_inflation
from identification.gap.rank.refinement import (
    best_fit_of_each,
    by_log_evidence,
    recalibrate,
    refine,
    refit_with_causes,
)
from identification.gap.rank.screening import ScreenedCause, screen_causes, simulate_signatures
from identification.gap.rank.separability import Separability, assess_separability
from identification.gap.rank.settings import RankingSettings


@dataclass(frozen=True, kw_only=True)
class Ranking:
    """Every hypothesis that was refitted, and the probability of each."""

    problem: FittingProblem
    recalibrated: EvaluatedHypothesis
    """The model without a cause."""
    hypotheses: list[EvaluatedHypothesis]
    """Single causes and pairs, the most probable first."""
    log_posteriors: list[float]
    """Log probabilities of `hypotheses`, but for a constant."""
    probabilities: list[float]
    """Probabilities of `hypotheses`; with the two following they sum to 1."""
    no_cause: float
    """Probability that no cause acts."""
    unknown: float
    """Probability that something outside the catalogue acts."""
    separability: Separability
    """What the recordings could tell apart, whatever the residual."""
    settings: RankingSettings


def rank_hypotheses(
    plant: GreyBox,
    cache: FitCache | None = None,
    settings: RankingSettings | None = None,
    fit_settings: FitSettings | None = None,
) -> Ranking:
    """Refit the promising hypotheses and weigh them; a fit that does not converge is weighed as it is.

    Args:
        plant: the model, its recordings and its catalogue of causes.
        cache: runs the fits; None keeps nothing.
        settings: judgement of the ranking; None: the defaults.
        fit_settings: judgement of the fits; None: the defaults.
    """
    settings, cache = settings or RankingSettings(), cache or FitCache(plant)
    problem, base = recalibrate(plant, cache, fit_settings)
    runs = linearise(problem, [base], problem.all_runs)[0]
    base_runs = [runs[r] for r in problem.fitted_runs]
    signatures = simulate_signatures(problem, base, plant.causes)
    bound = problem.settings.largest_deviation
    separability = assess_separability(base_runs, signatures, bound, settings)
    screened = screen_causes(base_runs, signatures, bound)
    first = cache(
        "single causes",
        lambda: refit_with_causes(problem, base, screened[: settings.refitted_causes]),
    )
    singles = by_log_evidence(evaluate(problem, first, settings))
    best = singles[: settings.finalists[1]]
    alike = _alike(best, screened[settings.refitted_causes :], separability, settings)
    if alike:
        more = cache("causes like the best", lambda: refit_with_causes(problem, base, alike))
        singles = by_log_evidence([*singles, *evaluate(problem, more, settings)])
    recalibrated = evaluate_linearised(problem, base, runs, settings)
    return _rank_refined(problem, recalibrated, singles, separability, cache, settings)


def _alike(
    best: Sequence[EvaluatedHypothesis],
    others: Sequence[ScreenedCause],
    separability: Separability,
    settings: RankingSettings,
) -> list[ScreenedCause]:
    """Causes that were screened out, though their signature resembles that of one of the best."""
    least = settings.alike_correlation
    labels = [label for each in best for label in separability.alike(each.labels[0], least)]
    return [screened for screened in others if screened.cause.label in labels]


def _rank_refined(
    problem: FittingProblem,
    recalibrated: EvaluatedHypothesis,
    singles: list[EvaluatedHypothesis],
    separability: Separability,
    cache: FitCache,
    settings: RankingSettings,
) -> Ranking:
    """Refine the finalists, add pairs, and weigh all of them."""
    recalibrated = refine(problem, [recalibrated], (1, 1), "recalibration", cache, settings)[0]
    first_fits = {single.labels: single.estimate for single in singles}
    lag = _largest_lag(recalibrated, singles, settings)
    singles = refine(problem, singles, settings.finalists, "causes", cache, settings, lag)
    scale = ResidualScale(
        lowest_excess=min(0.0, *(each.excess for each in (recalibrated, *singles))), settings=settings
    )
    all_pairs = fit_pairs(problem, recalibrated, singles, first_fits, scale, cache)
    counts = [count // 2 for count in settings.finalists]
    pairs = by_log_evidence(best_fit_of_each(all_pairs))
    pairs = refine(problem, pairs, counts, "pairs", cache, settings, lag)
    if pairs and scale.is_large(singles[0]):
        members = refit_members_of_best_pair(problem, singles, pairs, cache, settings)
        singles = refine(problem, members, (1,), "halves", cache, settings)
    pairs = [pair for pair in pairs if not pair.at_bound]
    return _weigh(problem, recalibrated, [*singles, *pairs], scale, separability)


def _largest_lag(
    recalibrated: EvaluatedHypothesis,
    singles: Sequence[EvaluatedHypothesis],
    settings: RankingSettings,
) -> float:
    """Log evidence by which the best hypothesis may lead one that is refined."""
    if not singles:
        return settings.finalist_lag
    gain = singles[0].log_evidence - recalibrated.log_evidence
    return max(settings.finalist_lag, settings.finalist_lag_share * gain)


def _weigh(
    problem: FittingProblem,
    recalibrated: EvaluatedHypothesis,
    hypotheses: list[EvaluatedHypothesis],
    scale: ResidualScale,
    separability: Separability,
) -> Ranking:
    """Probabilities of all hypotheses, of no cause and of an unknown one."""
    settings = scale.settings
    best = max([recalibrated, *hypotheses], key=lambda each: each.log_evidence)
    inflation = variance_inflation(problem.plant, best.residuals, settings.segment_duration)
    temper = 1.0 / inflation  # correlated samples count less (Miller and Dunson 2019)
    most = settings.misfit_share * recalibrated.excess
    small = [each.excess <= most and not each.at_bound for each in hypotheses]
    total_prior = sum(cause.prior for cause in problem.plant.causes)
    untempered = [_log_evidence(e, with_misfit=s) for e, s in zip(hypotheses, small, strict=True)]
    log_posteriors = [
        temper * log_evidence + (-np.inf if each.at_bound else _log_prior(each, total_prior, settings))
        for each, log_evidence in zip(hypotheses, untempered, strict=True)
    ]
    log_posteriors = limit_pair_odds(hypotheses, log_posteriors, scale)
    no_cause = temper * recalibrated.log_evidence + np.log(settings.prior_no_cause)
    large = [recalibrated, *(each for each, s in zip(hypotheses, small, strict=True) if not s)]
    with_misfit = max(each.log_evidence_with_misfit for each in large)
    unknown = temper * with_misfit + np.log(settings.prior_unknown)
    return _ranking(
        problem, recalibrated, hypotheses, log_posteriors, (no_cause, unknown), separability, settings
    )


def _ranking(
    problem: FittingProblem,
    recalibrated: EvaluatedHypothesis,
    hypotheses: list[EvaluatedHypothesis],
    log_posteriors: list[float],
    others: tuple[float, float],
    separability: Separability,
    settings: RankingSettings,
) -> Ranking:
    """Normalised probabilities; others: log posteriors of no cause and of an unknown one."""
    weights = softmax([*log_posteriors, *others])
    order = np.argsort(-np.array(log_posteriors), kind="stable")
    return Ranking(
        problem=problem,
        recalibrated=recalibrated,
        hypotheses=[hypotheses[i] for i in order],
        log_posteriors=[log_posteriors[i] for i in order],
        probabilities=weights[order].tolist(),
        no_cause=float(weights[-2]),
        unknown=float(weights[-1]),
        separability=separability,
        settings=settings,
    )


def _log_evidence(evaluated: EvaluatedHypothesis, *, with_misfit: bool) -> float:
    """Log evidence; with_misfit: a generic misfit beside the hypothesis is allowed."""
    if with_misfit:
        return max(evaluated.log_evidence, evaluated.log_evidence_with_misfit)
    return evaluated.log_evidence


def _log_prior(evaluated: EvaluatedHypothesis, total_prior: float, settings: RankingSettings) -> float:
    """Log probability of a cause or pair before any data."""
    shares = [cause.prior / total_prior for cause in evaluated.estimate.hypothesis.causes]
    if len(shares) == 1:
        return float(np.log(settings.prior_single * shares[0]))
    return float(np.log(settings.prior_pair * 2 * np.prod(shares)))
