"""The whole diagnosis of a grey-box plant: which cause, where, and how far the gap is reduced."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from identification.block_bootstrap import Interval
from identification.gap.fit.evidence import EvaluatedHypothesis, evaluate, evaluate_linearised
from identification.gap.fit.fitting_problem import Estimate, FitCache, FittingProblem, Hypothesis
from identification.gap.fit.gauss_newton import linearise
from identification.gap.fit.recalibration import (
    recalibrate,
    with_own_nuisances,
    with_ripple,
    with_seen_noise,
)
from identification.gap.judge.held_out import (
    NOMINAL,
    RECALIBRATED,
    DiscrepancyReduction,
    is_predictable,
    measure_discrepancy_reduction,
    predictable_shares,
)
from identification.gap.judge.verdict import (
    KNOWN,
    MOST,
    NO_GAP,
    SURE,
    Conclusion,
    RankedCause,
    Ranking,
    causes_by_name,
    conclude,
    smallest_set,
)
from identification.gap.locate.localisation import Localisation, locate
from identification.gap.plant import GreyBox
from identification.gap.plant_checks import check, check_description
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.prepare.screened import Finding
from identification.gap.search.cause_search import HypothesisPool, search_causes
from identification.gap.search.onset import Onset
from identification.gap.search.posterior import posterior
from identification.gap.search.screening import simulate_signatures
from identification.gap.search.separability import adapted_signatures, assess_separability

NOTICED_WORSENING = 0.05
"""Relative growth of the held-out gap by recalibration that is mentioned [1]."""

MENTIONED_PROBABILITY = 0.01
"""Probability from which reports mention a cause."""


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """All results of one diagnosis."""

    ranking: Ranking
    conclusion: Conclusion
    localisation: Localisation
    """Where the gap lies that recalibration leaves."""
    remaining: Localisation | None
    """Where the gap lies that the best cause leaves; None where nothing predictable is left."""
    reduction: DiscrepancyReduction
    nominal: EvaluatedHypothesis
    """The nominal model."""
    judged: list[RankedCause]
    """Causes whose discrepancy reduction was measured, the most probable first."""
    screened: tuple[Finding, ...]
    """Faulty readings that no fit uses."""
    onsets: Mapping[str, Onset] = field(default_factory=dict)
    """Of an operation log: where causes begin and end, by their labels; without those that act in all
    drives."""
    as_consumption: tuple[str, ...] = ()
    """Of an operation log: absorbed causes that would show if consumption were known."""
    warnings: list[str]
    """Faulty readings, doubts about the plant's description, and fits that did not converge, in
    sentences."""

    def onsets_of(self, cause: RankedCause) -> dict[str, Onset]:
        """Where those of its effects begin and end that do not act in all drives, by label."""
        labels = cause.hypothesis.labels
        return {label: self.onsets[label] for label in labels if label in self.onsets}

    @property
    def onset(self) -> Onset | None:
        """That of the best cause's first effect with one; None where all act in all drives."""
        return next(iter(self.onsets_of(self.best).values()), None) if self.best else None

    @property
    def best(self) -> RankedCause | None:
        """The most probable cause, whether it is named or not; None where none is needed."""
        return self.judged[0] if self.conclusion.verdict != NO_GAP and self.judged else None

    @property
    def named(self) -> RankedCause | None:
        """The most probable cause where the verdict names it."""
        return next(iter(self.conclusion.ambiguity_set), None)

    def share_closed(self, cause: RankedCause) -> Interval:
        """Share of the gap on held-out recordings that a judged cause closes [1].

        Raises KeyError for a cause whose reduction was not measured.
        """
        return self.reduction.shares_closed[cause.hypothesis.label]

    @property
    def helps(self) -> bool:
        """Whether the most probable cause is to be added: it surely reduces the held-out gap, and where
        its name is doubtful it surely closes most of it."""
        return bool(self.best) and self.share_closed(self.best).low > (0.0 if self.named else MOST)

    @property
    def model(self) -> EvaluatedHypothesis:
        """The model to use: with the most probable cause if it helps, else recalibrated or nominal.

        The nominal one where that is clearly worse on held-out recordings.
        """
        found = self.best.hypothesis if self.best and self.helps else self.ranking.recalibrated
        gaps = {name: self.reduction.gaps[name].overall.value for name in (_label(found), NOMINAL)}
        return (
            found if gaps[_label(found)] <= (1.0 + NOTICED_WORSENING) * gaps[NOMINAL] else self.nominal
        )

    @property
    def model_label(self) -> str:
        """The causes of the model to use in one line, as in files; else RECALIBRATED or NOMINAL."""
        return NOMINAL if self.model is self.nominal else _label(self.model)


def _label(hypothesis: EvaluatedHypothesis) -> str:
    return hypothesis.label or RECALIBRATED


def diagnose(plant: GreyBox, *, seed: int = 0, cache: FitCache | None = None) -> Diagnosis:
    """Diagnose the plant's recordings.

    Args:
        plant: the model, its recordings and its catalogue of causes.
        seed: of the bootstrap, the black box and the permutations.
        cache: runs the fits and may keep them; None keeps nothing.

    Raises:
        PlantError: something is wrong with the plant or its recordings; each finding is one line.
    """
    cache = cache or FitCache(plant)
    check_description(plant)
    usable = prepared(plant)
    warnings = check(usable)
    ranking = rank_hypotheses(usable, cache)
    cache.announce("where")
    localisation = _locate(ranking, ranking.recalibrated, seed)
    cache.announce("share closed")
    judged = _judged_causes(ranking)
    nominal = ranking.problem.start(Hypothesis(causes=()), {})
    estimates = {NOMINAL: nominal, RECALIBRATED: ranking.recalibrated.estimate}
    estimates |= {c.hypothesis.label: c.hypothesis.estimate for c in judged}
    reduction = measure_discrepancy_reduction(ranking.problem, estimates, seed=seed)
    conclusion = conclude(ranking, localisation, reduction)
    left = conclusion.verdict not in (NO_GAP, KNOWN)
    return Diagnosis(
        ranking=ranking,
        conclusion=conclusion,
        localisation=localisation,
        remaining=_locate(ranking, judged[0].hypothesis, seed) if left and judged else None,
        reduction=reduction,
        nominal=evaluate(ranking.problem, [nominal])[0],
        judged=judged,
        screened=usable.screened,
        warnings=[
            *warnings,
            *_ripples(ranking),
            *_worse_by_recalibration(reduction),
            *_unconverged(ranking.recalibrated, judged),
        ],
    )


def rank_hypotheses(plant: GreyBox, cache: FitCache | None = None) -> Ranking:
    """Refit the promising hypotheses and weigh them; a fit that does not converge is weighed as it is.

    Args:
        plant: the model, its recordings and its catalogue of causes.
        cache: runs the fits; None keeps nothing.
    """
    cache, plant = cache or FitCache(plant), prepared(plant)
    problem, base = recalibrated_by_seen_noise(plant, cache)
    ranking = _searched(problem, base, cache)
    if any(own.ripple for own in ranking.noise):
        foreseen = predictable_shares(problem, ranking.best.estimate)
        weighted = with_ripple(prepared(problem.plant), ranking.noise, foreseen)
        if weighted is not problem.plant:
            cache = cache.named("with the ripple filtered: ")
            ranking = _searched(*recalibrate(weighted, cache), cache)
    base = ranking.recalibrated
    if not ranking.much_is_left or is_predictable(ranking.problem, base.estimate):
        return ranking
    found = posterior(ranking.problem, base, ranking.hypotheses, predictable=False)
    return replace(ranking, **vars(found))


def recalibrated_by_seen_noise(plant: GreyBox, cache: FitCache) -> tuple[FittingProblem, Estimate]:
    """The recalibrated model; readings are weighed by the noise that its residuals show."""
    problem, base = recalibrate(plant, cache)
    corrected = with_seen_noise(problem, base)
    if corrected is problem.plant:
        return problem, base
    return recalibrate(corrected, cache, prefix="with the noise seen: ")


def _searched(problem: FittingProblem, base: Estimate, cache: FitCache) -> Ranking:
    """The search for causes beside the recalibrated model `base`; the most probable hypotheses first."""
    runs = linearise(problem, [base], problem.all_runs)[0]
    base_runs = [runs[r] for r in problem.fitted_runs]
    signatures = simulate_signatures(problem, base, problem.plant.causes)
    adapted = adapted_signatures(problem, base, base_runs, signatures)
    separability = assess_separability(base_runs, adapted)
    evaluated = evaluate_linearised(problem, base, runs)
    recalibrated = with_own_nuisances(problem, [evaluated], "recalibration: own nuisances", cache)[0]
    pool = HypothesisPool(problem, recalibrated, cache)
    search_causes(pool, base, signatures)
    found = vars(pool.posterior())
    return Ranking(problem=problem, recalibrated=pool.recalibrated, separability=separability, **found)


def _locate(ranking: Ranking, hypothesis: EvaluatedHypothesis, seed: int) -> Localisation:
    """Where the gap lies that a hypothesis leaves."""
    return locate(ranking.problem, hypothesis.estimate, hypothesis.residuals, seed)


def _judged_causes(ranking: Ranking) -> list[RankedCause]:
    """The fewest causes that hold most of the probability of all, and the next three single ones."""
    causes = causes_by_name(ranking)
    first = max(len(smallest_set(causes, SURE)), 1)
    singles = [cause for cause in causes[first:] if len(cause.effects) == 1]
    return [*causes[:first], *singles[:3]]


def _worse_by_recalibration(reduction: DiscrepancyReduction) -> list[str]:
    """A sentence where the refitted parameters suit the fitted recordings only."""
    before, after = (reduction.gaps[label].overall.value for label in (NOMINAL, RECALIBRATED))
    if after <= (1.0 + NOTICED_WORSENING) * before:
        return []
    return [
        f"recalibration makes recordings never fitted to worse, from {before:.3g} to {after:.3g} noise "
        "deviations: without the missing cause keep the nominal parameters"
    ]


def _ripples(ranking: Ranking) -> list[str]:
    """Channels whose readings carry a ripple at all times, a sentence each."""
    plant = prepared(ranking.problem.plant)
    return [
        f"{channel.name}: a ripple of {ripple.sd * channel.known_noise / channel.scale:.2g} "
        f"{channel.unit}, correlated over {ripple.samples * plant.runs[0].time[1]:.2g} s, lies on the "
        "readings at all times: they are filtered"
        for channel, ripple in zip(plant.channels, plant.ripples, strict=False)
        if ripple
    ]


def _unconverged(recalibrated: EvaluatedHypothesis, judged: list[RankedCause]) -> list[str]:
    """Fits that did not converge, of causes with a noticeable probability."""
    warnings = []
    if not recalibrated.converged:
        warnings.append("the recalibration did not converge: its gap may be too large")
    return warnings + [
        f"the fit of {cause.hypothesis.title} did not converge: its size and its "
        "probability are in doubt"
        for cause in judged
        if not cause.hypothesis.converged and cause.probability > MENTIONED_PROBABILITY
    ]
