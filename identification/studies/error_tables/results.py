"""Everything that the printed error tables say of the causes, computed: no text, no pictures."""

from collections.abc import Sequence
from dataclasses import dataclass

from identification.studies.error_tables.bench_conditions import drawn_condition_sets
from identification.studies.error_tables.candidates import candidates
from identification.studies.error_tables.current_errors import (
    CurrentResidual,
    WindingContribution,
    current_residual,
    winding_contribution,
)
from identification.studies.error_tables.error_prediction import (
    printed_calibrated_errors,
    printed_initial_errors,
)
from identification.studies.error_tables.pairs import (
    candidate_pair_misfits,
    cause_pair_misfits,
    cause_probabilities,
    pair_members,
    simulated_pairs,
)
from identification.studies.error_tables.predicted_tables import (
    PredictedTables,
    refined_tables,
    simulated_tables,
)
from identification.studies.error_tables.ranking import CauseMatch, ranked_causes
from identification.studies.error_tables.ranking_reliability import (
    RankingReliability,
    ranking_reliability,
)
from identification.studies.error_tables.settings import DEFAULTS, ErrorTableSettings


@dataclass(frozen=True, kw_only=True)
class ErrorTableResults:
    """The results of the study."""

    tables: PredictedTables
    """Predicted tables of every candidate."""
    residual: CurrentResidual
    """The current's residual under the fitted conditions."""
    winding: WindingContribution
    """The winding's part of the current's residual."""
    singles: list[CauseMatch]
    """Each cause alone, the nearest first."""
    pairs: list[CauseMatch]
    """The nearest pairs as simulated, the nearest first."""
    probability: dict[str, float]
    """Probability of each cause to be one of the two of a pair [-]."""
    reliability: RankingReliability
    """How far the ranking of pairs can be trusted."""
    seed: int
    """Of the test conditions and made-up tables."""
    settings: ErrorTableSettings
    """With which the results were computed."""


def error_table_results(
    *,
    seed: int = 0,
    causes: Sequence[str] | None = None,
    settings: ErrorTableSettings = DEFAULTS,
) -> ErrorTableResults:
    """Simulate the causes under drawn conditions and rank them. causes: None for all."""
    conditions = drawn_condition_sets(settings.draws, seed, settings)
    coarse = simulated_tables(
        candidates(causes, settings), conditions, "causes under drawn test conditions", settings
    )
    tables = refined_tables(coarse)
    calibrated, initial = printed_calibrated_errors(), printed_initial_errors()
    members = pair_members(tables, settings)
    misfits = candidate_pair_misfits(members, calibrated)
    # What no two causes of the catalogue explain is the scatter of the made-up tables.
    scatter = float(cause_pair_misfits(members, misfits).min())
    reliability = ranking_reliability(
        pair_members(coarse, settings), scatter, n=settings.known_tables, seed=seed, settings=settings
    )
    probability = cause_probabilities(members, misfits, reliability.kernel_width)
    return ErrorTableResults(
        tables=tables,
        residual=current_residual(conditions[0]),
        winding=winding_contribution(conditions, initial, calibrated, settings),
        singles=ranked_causes(tables, calibrated, initial, settings),
        pairs=simulated_pairs(members, misfits, calibrated, initial, settings),
        probability=dict(zip(members.causes, probability.tolist(), strict=True)),
        reliability=reliability,
        seed=seed,
        settings=settings,
    )
