"""Posterior predictive check of a verdict on held-out recordings (Gelman et al. 2013, chapter 6).

The evidence judges the residual by the form of the recordings that the fits have seen. The check
compares the verdict with what a black box predicts of the best cause's residual on recordings never
fitted to.
"""

from dataclasses import replace

from scipy.special import softmax

from identification.gap.rank.ranking import Ranking
from identification.gap.rank.verdict import AMBIGUOUS, KNOWN, UNKNOWN
from identification.gap.reduce.discrepancy_reduction import Unexplained


def check_predictively(ranking: Ranking, verdict: str, unexplained: Unexplained) -> Ranking:
    """The ranking, changed where the residual of the best cause contradicts the verdict.

    Args:
        ranking: the probabilities that led to the verdict.
        verdict: KNOWN, AMBIGUOUS, UNKNOWN or NO_GAP of `rank.verdict`.
        unexplained: what the best cause leaves on held-out runs.

    Returns:
        The same object where nothing contradicts the verdict.
    """
    settings = ranking.settings
    near_floor = unexplained.fraction <= settings.near_floor_share
    if verdict in (KNOWN, AMBIGUOUS) and unexplained.still_predictable and not near_floor:
        return _with_unknown(ranking, settings.contradicted_unknown)
    unpredictable = unexplained.p_value >= settings.unpredictable_p_value
    if verdict == UNKNOWN and near_floor and unpredictable and ranking.hypotheses:
        return _with_unknown(ranking, settings.confirmed_unknown)
    return ranking


def _with_unknown(ranking: Ranking, unknown: float) -> Ranking:
    """The ranking with another probability of unknown; causes share the rest in proportion."""
    causes = (1.0 - unknown - ranking.no_cause) * softmax(ranking.log_posteriors)
    return replace(ranking, unknown=unknown, probabilities=causes.tolist())
