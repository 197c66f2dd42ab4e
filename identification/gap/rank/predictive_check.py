"""A second look at a verdict: what a black box still predicts of what the first cause leaves.

`unknown` means that the best cause leaves a residual which is still predictable. Evidence judges that by
the forms of the recordings it has seen; here it is held against recordings never fitted to.
"""

from dataclasses import replace

from scipy.special import softmax

from identification.gap.rank.ranking import Verdicts
from identification.gap.rank.verdict import AMBIGUOUS, KNOWN, UNKNOWN
from identification.gap.reduce.discrepancy_reduction import Unexplained

NEAR = 0.12
"""Share of the explainable gap that a cause may leave and still be near the floor."""

NOTHING = 0.5
"""p-value of the black box's prediction from which it finds nothing."""

DOUBTED, TRUSTED = 0.9, 0.3
"""Probability of unknown where a named cause leaves too much that is predictable; where a cause that was
not named leaves little, and nothing predictable."""


def second_look(verdicts: Verdicts, verdict: str, left: Unexplained) -> Verdicts:
    """The probabilities, changed where what the first cause leaves contradicts the verdict."""
    near = left.fraction <= NEAR
    if verdict in (KNOWN, AMBIGUOUS) and left.still_predictable and not near:
        return _with_unknown(verdicts, DOUBTED)
    if verdict == UNKNOWN and near and left.p_value >= NOTHING and verdicts.candidates:
        return _with_unknown(verdicts, TRUSTED)
    return verdicts


def _with_unknown(verdicts: Verdicts, unknown: float) -> Verdicts:
    """The verdicts with another probability of unknown; causes share the rest as they did."""
    causes = (1.0 - unknown - verdicts.no_cause) * softmax(verdicts.scores)
    return replace(verdicts, unknown=unknown, probability=causes.tolist())
