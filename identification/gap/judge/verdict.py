"""The verdict on the probabilities, and the causes that the recordings cannot separate."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from identification.gap.fit.evidence import EvaluatedHypothesis
from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.judge.held_out import DiscrepancyReduction
from identification.gap.locate.localisation import Localisation
from identification.gap.search.posterior import Posterior
from identification.gap.search.separability import Separability

NO_GAP, KNOWN, AMBIGUOUS = "no_gap", "known", "ambiguous"
PARTIAL, UNKNOWN = "partial", "unknown"
"""Verdicts as gap.json has them."""

NAMING = (KNOWN, AMBIGUOUS, PARTIAL)
"""Verdicts that name a cause."""

SURE = 0.9
"""Probability from which a name is sure; share of all causes that the ambiguity set holds [1]."""

EXPLAINED_GAP = 1.15
"""Gap on held-out recordings up to which a cause explains all of it [noise deviations]: a third of the
noise's variance."""

MOST = 0.5
"""Share of the gap that a named cause closes at least [1]."""


@dataclass(frozen=True, kw_only=True)
class Ranking(Posterior):
    """Every hypothesis that was refitted, the most probable first."""

    problem: FittingProblem
    recalibrated: EvaluatedHypothesis
    """The model without a cause."""
    separability: Separability
    """What the recordings could tell apart, whatever the residual."""

    @property
    def inclusion(self) -> Mapping[str, float]:
        """Probability that each effect is part of the gap, alone or beside others, the highest first."""
        total: dict[str, float] = {}
        for hypothesis, probability in zip(self.hypotheses, self.probabilities, strict=True):
            for name in set(hypothesis.names):
                total[name] = total.get(name, 0.0) + probability
        return dict(sorted(total.items(), key=lambda pair: -pair[1]))


@dataclass(frozen=True, kw_only=True)
class RankedCause:
    """A cause, or several that act together, with all variants taken together."""

    effects: tuple[str, ...]
    """Names as in the catalogue."""
    probability: float
    """Sum over the variants."""
    hypothesis: EvaluatedHypothesis
    """The most probable variant."""


@dataclass(frozen=True, kw_only=True)
class Conclusion:
    """What a diagnosis concludes about the cause."""

    verdict: str
    """NO_GAP, KNOWN, AMBIGUOUS, PARTIAL or UNKNOWN."""
    causes: list[RankedCause]
    """All causes, the most probable first."""
    ambiguity_set: list[RankedCause]
    """The fewest causes that hold the required share of the probability of all causes; empty where no
    cause is named."""
    component_probabilities: dict[str, float]
    """Probability that a component is at fault, by component; a set may have several components."""


def conclude(
    ranking: Ranking, localisation: Localisation, reduction: DiscrepancyReduction
) -> Conclusion:
    """The verdict on the probabilities and on what held-out recordings show."""
    causes = causes_by_name(ranking)
    rivals = smallest_set(causes, SURE)
    verdict = _verdict(ranking, rivals, reduction)
    return Conclusion(
        verdict=verdict,
        causes=causes,
        ambiguity_set=rivals if verdict in NAMING else [],
        component_probabilities=component_probabilities(ranking, localisation),
    )


def _verdict(ranking: Ranking, rivals: Sequence[RankedCause], reduction: DiscrepancyReduction) -> str:
    """The likeliest of no cause, an unknown one and the named ones; then how sure and how complete.

    rivals: the fewest causes that hold the share SURE of the probability of all, the first one first.
    """
    named = sum(ranking.probabilities)
    if ranking.no_cause > max(named, ranking.unknown):
        return UNKNOWN if reduction.recalibration_leaves.still_predictable else NO_GAP
    if ranking.unknown > named or reduction.closed_by_first.high < MOST:
        return UNKNOWN
    first = rivals[0].probability
    explained = (
        reduction.left.overall.value <= EXPLAINED_GAP and not reduction.unexplained.still_predictable
    )
    if len(rivals) == 1:
        return KNOWN if explained and first >= SURE else PARTIAL
    return AMBIGUOUS if explained or first < 0.5 else PARTIAL


def causes_by_name(ranking: Ranking) -> list[RankedCause]:
    """Hypotheses grouped by the names of their causes, the most probable first."""
    best: dict[frozenset[str], EvaluatedHypothesis] = {}
    total: dict[frozenset[str], float] = {}
    for hypothesis, probability in zip(ranking.hypotheses, ranking.probabilities, strict=True):
        names = frozenset(hypothesis.names)
        best.setdefault(names, hypothesis)
        total[names] = total.get(names, 0.0) + probability
    causes = [
        RankedCause(
            effects=tuple(dict.fromkeys(hypothesis.names)),
            probability=total[names],
            hypothesis=hypothesis,
        )
        for names, hypothesis in best.items()
    ]
    return sorted(causes, key=lambda cause: -cause.probability)


def smallest_set(causes: Sequence[RankedCause], share: float) -> list[RankedCause]:
    """The fewest causes that hold a share [1] of the probability of all, the most probable first."""
    whole = sum(cause.probability for cause in causes)
    chosen, held = [], 0.0
    for cause in causes:
        if held >= share * whole:
            break
        chosen.append(cause)
        held += cause.probability
    return chosen


def component_probabilities(ranking: Ranking, localisation: Localisation) -> dict[str, float]:
    """Probability that each component is at fault, the highest first.

    A named cause lies in its component. For an unknown cause the fault localisation decides.
    """
    total = {cause.component: 0.0 for cause in ranking.problem.plant.causes}
    for hypothesis, probability in zip(ranking.hypotheses, ranking.probabilities, strict=True):
        for component in {c.component for c in hypothesis.estimate.hypothesis.causes}:
            total[component] += probability
    shares = localisation.component_probabilities
    whole = sum(shares.values())
    for component, share in shares.items() if whole > 0 else ():
        total[component] = total.get(component, 0.0) + ranking.unknown * (share / whole)
    return dict(sorted(total.items(), key=lambda pair: -pair[1]))
