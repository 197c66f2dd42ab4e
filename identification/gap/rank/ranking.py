"""Ranking of hypotheses: recalibration, screening, search, probabilities."""

from collections.abc import Mapping
from dataclasses import dataclass

from identification.gap.fit.fit_cache import FitCache
from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.hypothesis import Estimate
from identification.gap.fit.linearisation import linearise
from identification.gap.fit.settings import FitSettings
from identification.gap.model.grey_box import GreyBox
from identification.gap.model.prepared_plant import prepared
from identification.gap.rank.cause_search import search_causes
from identification.gap.rank.discrepancy import ChannelDiscrepancy
from identification.gap.rank.evidence import EvaluatedHypothesis, evaluate_linearised
from identification.gap.rank.hypothesis_pool import HypothesisPool
from identification.gap.rank.noise_correction import with_disturbance, with_seen_noise
from identification.gap.rank.posterior import Posterior, variance_inflation
from identification.gap.rank.refinement import recalibrate, with_own_nuisances
from identification.gap.rank.screening import simulate_signatures
from identification.gap.rank.separability import Separability, assess_separability
from identification.gap.rank.settings import RankingSettings
from identification.gap.reduce.settings import ReductionSettings


@dataclass(frozen=True, kw_only=True)
class Ranking:
    """Every hypothesis that was refitted, and the probability of each."""

    problem: FittingProblem
    recalibrated: EvaluatedHypothesis
    """The model without a cause."""
    hypotheses: list[EvaluatedHypothesis]
    """Single causes and sets of causes, the most probable first."""
    probabilities: list[float]
    """Probabilities of `hypotheses`; with the two following they sum to 1."""
    no_cause: float
    """Probability that no cause acts."""
    unknown: float
    """Probability that what acts has no name in the catalogue."""
    shares_left: list[float]
    """Share of the misfit beyond noise that each of `hypotheses` leaves [1]."""
    discrepancies: list[ChannelDiscrepancy]
    """Noise and discrepancy of each channel under the best hypothesis."""
    separability: Separability
    """What the recordings could tell apart, whatever the residual."""
    settings: RankingSettings

    @property
    def inclusion(self) -> Mapping[str, float]:
        """Probability that each effect is part of the gap, alone or beside others, the highest first."""
        total: dict[str, float] = {}
        for hypothesis, probability in zip(self.hypotheses, self.probabilities, strict=True):
            for name in {cause.name for cause in hypothesis.estimate.hypothesis.causes}:
                total[name] = total.get(name, 0.0) + probability
        return dict(sorted(total.items(), key=lambda pair: -pair[1]))

    @property
    def inflation(self) -> float:
        """`variance_inflation` of the best hypothesis [1]."""
        best = self.hypotheses[0] if self.hypotheses else self.recalibrated
        return variance_inflation(best, self.discrepancies)


def rank_hypotheses(
    plant: GreyBox,
    cache: FitCache | None = None,
    settings: RankingSettings | None = None,
    fit_settings: FitSettings | None = None,
    floor: ReductionSettings | None = None,
) -> Ranking:
    """Refit the promising hypotheses and weigh them; a fit that does not converge is weighed as it is.

    Args:
        plant: the model, its recordings and its catalogue of causes.
        cache: runs the fits; None keeps nothing.
        settings: judgement of the ranking; None: the defaults.
        fit_settings: judgement of the fits; None: the defaults.
        floor: how noise is seen in residuals; None: the defaults.
    """
    settings, cache, plant = settings or RankingSettings(), cache or FitCache(plant), prepared(plant)
    fit_settings = fit_settings or FitSettings()
    if len(plant.causes) <= settings.multi_start_causes:
        fit_settings = fit_settings.thorough
    problem, base = recalibrate(plant, cache, fit_settings)
    corrected = with_seen_noise(problem, base, settings, floor or ReductionSettings())
    if corrected is not plant:
        problem, base = recalibrate(corrected, cache, fit_settings, "with the noise seen: ")
    ranking = _searched(problem, base, cache, settings)
    weighted = with_disturbance(corrected, ranking.discrepancies, settings)
    if weighted is corrected:
        return ranking
    cache = cache.named("with the disturbance: ")
    return _searched(*recalibrate(weighted, cache, fit_settings), cache, settings)


def _searched(
    problem: FittingProblem, base: Estimate, cache: FitCache, settings: RankingSettings
) -> Ranking:
    """The search for causes beside a recalibrated model, and what it found.

    Args:
        problem: readings and settings of the fits.
        base: the recalibrated model.
        cache: runs the fits.
        settings: judgement.
    """
    runs = linearise(problem, [base], problem.all_runs)[0]
    base_runs = [runs[r] for r in problem.fitted_runs]
    signatures = simulate_signatures(problem, base, problem.plant.causes)
    separability = assess_separability(
        base_runs, signatures, problem.settings.largest_deviation, settings
    )
    evaluated = evaluate_linearised(problem, base, runs, settings)
    step = "recalibration: own nuisances"
    recalibrated = with_own_nuisances(problem, [evaluated], step, cache, settings)[0]
    pool = HypothesisPool(problem, recalibrated, cache, settings)
    search_causes(pool, base, base_runs, signatures, separability)
    hypotheses, found = pool.posterior()
    return _ranking(problem, recalibrated, hypotheses, found, separability, settings)


def _ranking(
    problem: FittingProblem,
    recalibrated: EvaluatedHypothesis,
    hypotheses: list[EvaluatedHypothesis],
    found: Posterior,
    separability: Separability,
    settings: RankingSettings,
) -> Ranking:
    """Hypotheses by falling probability; equal ones by their scores."""
    keys = zip(found.probabilities, found.scores, strict=True)
    order = [i for i, _ in sorted(enumerate(keys), key=lambda item: item[1], reverse=True)]
    return Ranking(
        problem=problem,
        recalibrated=recalibrated,
        hypotheses=[hypotheses[i] for i in order],
        probabilities=[found.probabilities[i] for i in order],
        no_cause=found.no_cause,
        unknown=found.unknown,
        shares_left=[found.shares_left[i] for i in order],
        discrepancies=found.discrepancies,
        separability=separability,
        settings=settings,
    )
