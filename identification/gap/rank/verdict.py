"""The verdict: what the probabilities amount to, and which causes belong together in doubt."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from identification.gap.locate.fault_localisation import Where
from identification.gap.rank.evidence import Assessed
from identification.gap.rank.ranking import Verdicts

NO_GAP, KNOWN, AMBIGUOUS, UNKNOWN = "no_gap", "known", "ambiguous", "unknown"

DOUBT = 0.001
"""Probability of no cause above which none is named: a false alarm costs more than a faint cause."""

HELD = 0.9
"""Share of the probability that an ambiguity set holds."""


@dataclass(frozen=True, kw_only=True)
class Ranked:
    """A cause, or several that act together, whatever the variant."""

    effects: tuple[str, ...]
    """Names as in the catalogue."""
    probability: float
    found: Assessed
    """Its most probable variant."""


@dataclass(frozen=True, kw_only=True)
class Conclusion:
    """What a diagnosis says about the cause."""

    verdict: str
    """NO_GAP, KNOWN, AMBIGUOUS or UNKNOWN."""
    causes: list[Ranked]
    """The most probable first."""
    ambiguity: list[Ranked]
    """The fewest causes that hold HELD of what all causes have; none where no cause is named."""
    component: dict[str, float]
    """Probability that a component is at fault; a pair may have two."""


def conclude(verdicts: Verdicts, where: Where) -> Conclusion:
    """The verdict on probabilities, and the components they point at."""
    causes = ranked(verdicts)
    verdict = _verdict(verdicts)
    ambiguity = smallest(causes, HELD) if verdict == KNOWN else []
    if len(ambiguity) > 1:
        verdict = AMBIGUOUS
    return Conclusion(
        verdict=verdict,
        causes=causes,
        ambiguity=ambiguity,
        component=components(verdicts, where),
    )


def ranked(verdicts: Verdicts) -> list[Ranked]:
    """Candidates by the names of their causes, the most probable first."""
    best: dict[frozenset[str], Assessed] = {}
    total: dict[frozenset[str], float] = {}
    for found, probability in zip(verdicts.candidates, verdicts.probability, strict=True):
        names = frozenset(cause.name for cause in found.point.hypothesis.causes)
        best.setdefault(names, found)
        total[names] = total.get(names, 0.0) + probability
    causes = [
        Ranked(
            effects=tuple(dict.fromkeys(cause.name for cause in found.point.hypothesis.causes)),
            probability=total[names],
            found=found,
        )
        for names, found in best.items()
    ]
    return sorted(causes, key=lambda cause: -cause.probability)


def smallest(causes: Sequence[Ranked], held: float) -> list[Ranked]:
    """The fewest causes that hold a share of what all of them have, the most probable first."""
    whole = sum(cause.probability for cause in causes)
    found, share = [], 0.0
    for cause in causes:
        if share >= held * whole:
            break
        found.append(cause)
        share += cause.probability
    return found


def components(verdicts: Verdicts, where: Where) -> dict[str, float]:
    """Probability that each component is at fault.

    A named cause lies in its component; where no name fits, the equations say where something is
    missing.
    """
    plant = verdicts.fitter.plant
    found = {cause.component: 0.0 for cause in plant.causes}
    for candidate, probability in zip(verdicts.candidates, verdicts.probability, strict=True):
        for component in {cause.component for cause in candidate.point.hypothesis.causes}:
            found[component] += probability
    for component, share in _located(where).items():
        found[component] = found.get(component, 0.0) + verdicts.unknown * share
    return dict(sorted(found.items(), key=lambda pair: -pair[1]))


def _located(where: Where) -> Mapping[str, float]:
    """Shares of the components by the equations alone."""
    shares: dict[str, float] = {}
    for forcing in where.forcings:
        component = forcing.equation.component
        shares[component] = shares.get(component, 0.0) + where.equation[forcing.equation.name]
    whole = sum(shares.values())
    return {component: share / whole for component, share in shares.items()} if whole > 0 else {}


def _verdict(verdicts: Verdicts) -> str:
    if verdicts.no_cause > DOUBT:
        return NO_GAP
    return UNKNOWN if verdicts.unknown > sum(verdicts.probability) else KNOWN
