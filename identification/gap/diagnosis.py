"""The whole diagnosis of a grey-box plant: which cause, where, and how far the gap is reduced."""

from dataclasses import dataclass, replace

from identification.gap.fit.fit_cache import FitCache
from identification.gap.fit.hypothesis import Estimate, Hypothesis
from identification.gap.locate.fault_localisation import Localisation, locate
from identification.gap.model.checks import check
from identification.gap.model.grey_box import GreyBox
from identification.gap.model.prepared_plant import prepared
from identification.gap.rank.evidence import EvaluatedHypothesis
from identification.gap.rank.ranking import Ranking, rank_hypotheses
from identification.gap.rank.verdict import (
    AMBIGUOUS,
    KNOWN,
    PARTIAL,
    UNKNOWN,
    Conclusion,
    RankedCause,
    conclude,
)
from identification.gap.reduce.block_bootstrap import Interval
from identification.gap.reduce.discrepancy_reduction import (
    NOMINAL,
    RECALIBRATED,
    DiscrepancyReduction,
    measure_discrepancy_reduction,
)
from identification.gap.settings import DiagnosisSettings


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
    nominal: Estimate
    """The nominal model."""
    judged: list[RankedCause]
    """Causes whose discrepancy reduction was measured, the most probable first."""
    warnings: list[str]
    """Doubts about the plant's description and fits that did not converge, in sentences."""
    settings: DiagnosisSettings

    @property
    def best(self) -> RankedCause | None:
        """The cause that the verdict names, or the nearest one; None where none is needed."""
        named = self.conclusion.verdict in (KNOWN, AMBIGUOUS, PARTIAL, UNKNOWN)
        return self.judged[0] if named and self.judged else None

    @property
    def named(self) -> RankedCause | None:
        """The most probable cause of those that the verdict names; None where it names none."""
        return next(iter(self.conclusion.ambiguity_set), None)

    def share_closed(self, cause: RankedCause) -> Interval:
        """Share of the gap on held-out recordings that a judged cause closes [1].

        Raises KeyError for a cause whose reduction was not measured.
        """
        return self.reduction.shares_closed[hypothesis_label(cause.hypothesis)]

    @property
    def kept(self) -> EvaluatedHypothesis:
        """The model to use: with the named cause where it surely reduces the gap, else recalibrated."""
        helps = self.named and self.surely_helps(self.named)
        return self.named.hypothesis if self.named and helps else self.ranking.recalibrated

    def surely_helps(self, cause: RankedCause) -> bool:
        """Whether adding a judged cause surely reduces the gap on held-out recordings."""
        return self.share_closed(cause).low > 0.0


def hypothesis_label(hypothesis: EvaluatedHypothesis) -> str:
    """A hypothesis in one line, as in files."""
    return " + ".join(hypothesis.labels)


def hypothesis_title(hypothesis: EvaluatedHypothesis) -> str:
    """A hypothesis in one line, for people."""
    return " + ".join(hypothesis.titles)


def diagnose(
    plant: GreyBox,
    *,
    settings: DiagnosisSettings | None = None,
    seed: int = 0,
    cache: FitCache | None = None,
) -> Diagnosis:
    """Diagnose the plant's recordings.

    Args:
        plant: the model, its recordings and its catalogue of causes.
        settings: judgement of every stage; None: the defaults.
        seed: of the bootstrap, the black box and the permutations.
        cache: runs the fits and may keep them; None keeps nothing.

    Raises:
        PlantError: something is wrong with the plant or its recordings; each finding is one line.
    """
    settings, cache = settings or DiagnosisSettings(), cache or FitCache(plant)
    warnings = check(plant, settings.preparation)
    plant = prepared(plant, settings.preparation)
    ranking = rank_hypotheses(plant, cache, settings.ranking, settings.fit, settings.reduction)
    cache.announce("where")
    localisation = _locate(ranking, ranking.recalibrated, seed, settings)
    cache.announce("how far it shrinks")
    diagnosis = _judge(ranking, localisation, seed, settings)
    return replace(diagnosis, warnings=[*warnings, *diagnosis.warnings])


def _locate(
    ranking: Ranking, hypothesis: EvaluatedHypothesis, seed: int, settings: DiagnosisSettings
) -> Localisation:
    """Where the gap lies that a hypothesis leaves."""
    return locate(
        ranking.problem,
        hypothesis.estimate,
        hypothesis.residuals,
        seed,
        settings.localisation,
        settings.reduction,
    )


def _judge(
    ranking: Ranking, localisation: Localisation, seed: int, settings: DiagnosisSettings
) -> Diagnosis:
    """The verdict on the probabilities, and how far the causes that count reduce the gap."""
    problem, recalibrated = ranking.problem, ranking.recalibrated
    conclusion = conclude(ranking, localisation)
    judged = _judged_causes(conclusion, settings.report.judged_runners_up)
    nominal = problem.start(Hypothesis(causes=()), {})
    estimates = {NOMINAL: nominal, RECALIBRATED: recalibrated.estimate}
    estimates |= {hypothesis_label(c.hypothesis): c.hypothesis.estimate for c in judged}
    reduction = measure_discrepancy_reduction(problem, estimates, seed=seed, settings=settings.reduction)
    left = conclusion.verdict in (PARTIAL, UNKNOWN) or (
        conclusion.verdict in (KNOWN, AMBIGUOUS) and reduction.unexplained.still_predictable
    )
    remaining = _locate(ranking, judged[0].hypothesis, seed, settings) if left and judged else None
    return Diagnosis(
        ranking=ranking,
        conclusion=conclusion,
        localisation=localisation,
        remaining=remaining,
        reduction=reduction,
        nominal=nominal,
        judged=judged,
        warnings=[
            *_disturbances(ranking),
            *_warnings(recalibrated, judged, settings.report.mentioned_probability),
        ],
        settings=settings,
    )


def _judged_causes(conclusion: Conclusion, runners_up: int) -> list[RankedCause]:
    """The ambiguity set, or the most probable cause, and the next single causes."""
    first = max(len(conclusion.ambiguity_set), 1)
    singles = [cause for cause in conclusion.causes[first:] if len(cause.effects) == 1]
    return [*conclusion.causes[:first], *singles[:runners_up]]


def _disturbances(ranking: Ranking) -> list[str]:
    """Channels whose readings carry a disturbance at all times, a sentence each."""
    channels = ranking.problem.plant.channels
    return [
        f"{channel.name}: a disturbance of {d.sd * channel.known_noise / channel.scale:.2g} "
        f"{channel.unit}, correlated over {d.time_scale:.2g} s, lies on the readings at all times: they "
        "weigh less"
        for channel, d in zip(channels, ranking.discrepancies, strict=True)
        if d.inflation > 1.0
    ]


def _warnings(
    recalibrated: EvaluatedHypothesis, judged: list[RankedCause], mentioned_probability: float
) -> list[str]:
    """Fits that did not converge, of causes with a noticeable probability."""
    warnings = []
    if not recalibrated.converged:
        warnings.append("the recalibration did not converge: its gap may be too large")
    return warnings + [
        f"the fit of {hypothesis_title(cause.hypothesis)} did not converge: its size and its "
        "probability are in doubt"
        for cause in judged
        if not cause.hypothesis.converged and cause.probability > mentioned_probability
    ]
