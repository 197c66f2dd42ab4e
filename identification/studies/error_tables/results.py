"""Everything that the printed error tables say of the causes, computed: no text, no pictures."""

from collections.abc import Sequence
from dataclasses import dataclass

from identification.studies.error_tables.candidates import candidates
from identification.studies.error_tables.current_errors import Residual, Winding, residual, winding
from identification.studies.error_tables.pairs import (
    all_misfits,
    checked,
    nearest,
    probabilities,
    usable,
)
from identification.studies.error_tables.patterns import printed_after, printed_before
from identification.studies.error_tables.predicted_tables import Library, drawn, refined, simulated
from identification.studies.error_tables.ranking import Match, matches
from identification.studies.error_tables.ranking_reliability import Trust, trust

DRAWS = 8
"""Sets of test conditions."""

KNOWN_TABLES = 150
"""Made-up tables by which the ranking of pairs is judged."""


@dataclass(frozen=True, kw_only=True)
class Study:
    """What was found."""

    library: Library
    residual: Residual
    winding: Winding
    singles: list[Match]
    """Each cause alone, the nearest first."""
    checked: list[Match]
    """The nearest pairs as simulated, the nearest first."""
    probability: dict[str, float]
    """Of each cause to be one of the two of a pair."""
    trust: Trust
    seed: int


def study(*, seed: int = 0, draws: int = DRAWS, causes: Sequence[str] | None = None) -> Study:
    """Simulate the causes under drawn conditions and rank them. causes: None for all."""
    conditions = drawn(draws, seed)
    coarse = simulated(candidates(causes), conditions, "causes under drawn test conditions")
    library = refined(coarse)
    after, before = printed_after(), printed_before()
    halves = usable(library)
    misfit = all_misfits(halves, after)
    scatter = float(nearest(halves, misfit).min())  # what no two causes of the catalogue explain
    known = trust(usable(coarse), scatter, n=KNOWN_TABLES, seed=seed)
    probability = probabilities(halves, misfit, known.width)
    return Study(
        library=library,
        residual=residual(conditions[0]),
        winding=winding(conditions, before, after),
        singles=matches(library, after, before),
        checked=checked(halves, misfit, after, before),
        probability=dict(zip(halves.causes, probability.tolist(), strict=True)),
        trust=known,
        seed=seed,
    )
