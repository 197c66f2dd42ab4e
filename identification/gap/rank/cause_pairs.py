"""Pairs of causes: which partners are tried, and how likely a second cause is beside an error of form.

Where the form of a cause errs, any second cause improves the fit. Evidence that treats every segment as
independent soon becomes certain of the second cause, since errors of form persist. So the odds of a pair
against its stronger member are limited by experience from the blind trials of seeds 2027 and 2028
(docs/explanation/diagnosis-settings.md).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.gap.fit.fit_cache import FitCache
from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.gauss_newton import fit
from identification.gap.fit.hypothesis import Estimate, Hypothesis
from identification.gap.fit.linearisation import linearise
from identification.gap.rank.evidence import EvaluatedHypothesis, evaluate
from identification.gap.rank.refinement import best_fit_of_each, by_log_evidence, refit_with_causes
from identification.gap.rank.screening import screen_causes, simulate_signatures
from identification.gap.rank.settings import RankingSettings


@dataclass(frozen=True, kw_only=True)
class ResidualScale:
    """How large a residual a hypothesis leaves, above that of the best hypothesis."""

    lowest_excess: float
    """Excess chi-square of the best hypothesis where the noise is known too large (below 0), else 0."""
    settings: RankingSettings

    def residual(self, evaluated: EvaluatedHypothesis) -> float:
        """Sum of squares left by a hypothesis [1]: beyond noise, or explained by a generic misfit."""
        predictable = 2.0 * (evaluated.log_evidence_with_misfit - evaluated.log_evidence)
        return max(evaluated.excess - self.lowest_excess, predictable)

    def is_large(self, evaluated: EvaluatedHypothesis) -> bool:
        """Whether a hypothesis leaves a large residual."""
        return self.residual(evaluated) > self.settings.large_residual


def fit_pairs(
    problem: FittingProblem,
    recalibrated: EvaluatedHypothesis,
    singles: list[EvaluatedHypothesis],
    first_fits: Mapping[tuple[str, ...], Estimate],
    scale: ResidualScale,
    cache: FitCache,
) -> list[EvaluatedHypothesis]:
    """Pairs that may explain the residuals of the best causes.

    Args:
        problem: readings and settings of the fits.
        recalibrated: the model without a cause.
        singles: single causes by falling log evidence.
        first_fits: estimate of each cause before its refinement, by labels. Refined nuisance parameters
            follow what the cause lacks; from the first fit a partner is seen better.
        scale: of the residuals.
        cache: runs the fits.
    """
    settings = scale.settings
    gain = singles[0].log_evidence - recalibrated.log_evidence if singles else -np.inf
    if gain < settings.least_single_gain:
        return []
    large = scale.is_large(singles[0])
    partners = settings.partners if large else settings.partners_of_small_residual
    most = settings.second_base_ratio * scale.residual(singles[0])
    bases = [each for each in singles[: 2 if large else 1] if scale.residual(each) <= most]
    return [
        pair
        for base in bases
        for pair in evaluate(
            problem, _fit_partners(problem, first_fits[base.labels], partners, cache), settings
        )
    ]


def _fit_partners(
    problem: FittingProblem, base: Estimate, count: int, cache: FitCache
) -> list[Estimate]:
    """Fits of the causes that may act beside those of the base."""
    own = base.hypothesis.causes[0].name
    others = [cause for cause in problem.plant.causes if cause.name != own]

    def refit() -> list[Estimate]:
        signatures = simulate_signatures(problem, base, others)
        base_runs = linearise(problem, [base], problem.fitted_runs)[0]
        bound = problem.settings.largest_deviation
        return refit_with_causes(problem, base, screen_causes(base_runs, signatures, bound)[:count])

    return cache(f"pairs with {' and '.join(base.hypothesis.labels)}", refit)


def refit_members_of_best_pair(
    problem: FittingProblem,
    singles: list[EvaluatedHypothesis],
    pairs: Sequence[EvaluatedHypothesis],
    cache: FitCache,
    settings: RankingSettings,
) -> list[EvaluatedHypothesis]:
    """Singles, with the members of the best pair also fitted from their values in the pair.

    Far from its true value a single cause may get stuck where a pair does not.

    Args:
        problem: readings and settings of the fits.
        singles: single causes.
        pairs: at least one, by falling log evidence.
        cache: runs the fits.
        settings: of the evidence.
    """
    pair, values = pairs[0].estimate, problem.values(pairs[0].estimate)
    starts = [
        replace(problem.start(Hypothesis(causes=(cause,)), values), slopes=pair.slopes)
        for cause in pair.hypothesis.causes
    ]
    fitted = cache("halves of the best pair", lambda: fit(problem, starts))
    # A journal keeps no slopes.
    alone = [replace(estimate, slopes=pair.slopes) for estimate in fitted]
    return by_log_evidence(best_fit_of_each([*singles, *evaluate(problem, alone, settings)]))


def limit_pair_odds(
    evaluated: Sequence[EvaluatedHypothesis], log_posteriors: Sequence[float], scale: ResidualScale
) -> list[float]:
    """Log posteriors, but for a constant, in which the odds of a pair against its member are limited.

    If a pair removes enough of the residual that its stronger member leaves, we raise that member's odds
    to the pair's. Otherwise we lower all pairs with that member to the limit.

    Args:
        evaluated: single causes and pairs.
        log_posteriors: of these, but for a constant.
        scale: of the residuals.
    """
    limited = list(log_posteriors)
    pairs_of: dict[int, list[int]] = {}
    for i, each in enumerate(evaluated):
        member = _stronger_member(each, evaluated) if len(each.labels) > 1 else None
        if member is not None:
            pairs_of.setdefault(member, []).append(i)
    for member, pairs in pairs_of.items():
        best = max(pairs, key=lambda pair: log_posteriors[pair])
        limit = _log_odds_limit(evaluated[best], evaluated[member], scale.settings)
        surplus = log_posteriors[best] - limit - log_posteriors[member]
        if surplus <= 0:
            continue
        if scale.is_large(evaluated[member]) and _explains(evaluated[best], evaluated[member], scale):
            limited[member] += surplus
        else:
            for pair in pairs:
                limited[pair] -= surplus
    return limited


def _explains(pair: EvaluatedHypothesis, member: EvaluatedHypothesis, scale: ResidualScale) -> bool:
    """Whether a pair removes enough of its member's residual to confirm the member."""
    return scale.residual(pair) <= scale.settings.explained_pair_share * scale.residual(member)


def _stronger_member(pair: EvaluatedHypothesis, evaluated: Sequence[EvaluatedHypothesis]) -> int | None:
    """Index of the member with more evidence alone; None if neither has any within its range."""
    members = [
        i
        for i, each in enumerate(evaluated)
        if len(each.labels) == 1 and each.labels[0] in pair.labels and not each.at_bound
    ]
    return max(members, key=lambda i: evaluated[i].log_evidence, default=None)


def _log_odds_limit(
    pair: EvaluatedHypothesis, member: EvaluatedHypothesis, settings: RankingSettings
) -> float:
    """Log of how much likelier a second cause is than an error of the first cause's form."""
    gain = pair.log_evidence_with_misfit - member.log_evidence_with_misfit
    if gain <= settings.chance_gain:
        return float(np.log(settings.chance_odds))
    readings = sum(np.count_nonzero(residual) for residual in pair.residuals)
    even = settings.even_odds_gain * readings
    return float(np.log((gain / even) ** 2 + settings.faint_cause_odds))
