"""A set of causes is doubted where one more cause explains nearly all that it leaves."""

from dataclasses import replace

import numpy as np
import pytest

from identification.gap.diagnosis import rank_hypotheses
from identification.gap.posterior import (
    CHANCE_MISFIT,
    COMPLETING_SHARE,
    FORM_ERROR_SHARE,
    HIDDEN_SHARE,
    log_completeness,
    with_hidden_causes,
)
from identification.gap.verdict import Ranking
from tests.identification.gap.drives import Drive


@pytest.fixture(scope="module")
def two_causes() -> Ranking:
    return rank_hypotheses(Drive({"coupling": 0.1, "dead_zone": 0.15}))


def doubts(found: Ranking, misfits: dict[frozenset[str], float], other: float = 1e4) -> dict:
    """Log completeness of each set, by the labels of its causes; `other`: misfit of sets not given."""
    sets = [frozenset(each.labels) for each in found.hypotheses]
    values = np.array([misfits.get(own, other) for own in sets])
    return dict(zip(sets, log_completeness(found.hypotheses, values), strict=True))


ONE, BOTH = frozenset({"coupling"}), frozenset({"coupling", "dead_zone"})


def test_a_set_that_leaves_what_another_cause_explains_is_doubted(two_causes):
    found = doubts(two_causes, {ONE: 700.0, BOTH: 7.0})
    assert found[ONE] < np.log(0.01)
    assert found[BOTH] == 0.0


def test_a_set_is_hardly_doubted_where_another_cause_explains_half(two_causes):
    assert doubts(two_causes, {ONE: 700.0, BOTH: 350.0})[ONE] > np.log(0.95)


def test_what_chance_leaves_is_no_reason_for_doubt(two_causes):
    assert doubts(two_causes, {ONE: 6.0, BOTH: 1.0})[ONE] > np.log(0.95)


def test_the_doubt_is_one_half_at_the_even_share(two_causes):
    chance = CHANCE_MISFIT
    small = COMPLETING_SHARE * (1000.0 + chance) - chance
    assert doubts(two_causes, {ONE: 1000.0, BOTH: small})[ONE] == pytest.approx(np.log(0.5))


def test_a_cause_at_the_end_of_its_range_explains_nothing(two_causes):
    hypotheses = [replace(each, at_bound=True) for each in two_causes.hypotheses]
    misfits = np.linspace(1.0, 1000.0, len(hypotheses))
    assert np.all(log_completeness(hypotheses, misfits) == 0.0)


def test_a_small_second_cause_beside_a_large_one_is_named():
    """It closes less of the gap than an error of the first one's form may, and is there all the same."""
    found = rank_hypotheses(Drive({"coupling": 0.9, "dead_zone": 0.04}))
    alone = next(i for i, each in enumerate(found.hypotheses) if each.labels == ("coupling",))
    assert found.shares_left[alone] < FORM_ERROR_SHARE
    assert found.inclusion["dead_zone"] > 0.9


def hidden(found: Ranking, misfit: float) -> dict[frozenset[str], float]:
    """Probabilities by labels where ONE alone has all, and each set leaves the misfit [nats]."""
    sets = [frozenset(each.labels) for each in found.hypotheses]
    count = len(sets)
    spread = with_hidden_causes(
        np.array([float(own == ONE) for own in sets]),
        found.hypotheses,
        np.full(count, misfit),
        np.zeros(count),
    )
    return dict(zip(sets, spread, strict=True))


def test_a_second_cause_may_hide_where_much_is_left(two_causes):
    found = hidden(two_causes, 1e6)
    assert found[ONE] == pytest.approx(1.0 - HIDDEN_SHARE, rel=1e-6)
    assert found[BOTH] > 0.0
    assert sum(p for own, p in found.items() if own >= ONE) == pytest.approx(1.0)


def test_no_cause_hides_where_nothing_is_left(two_causes):
    assert hidden(two_causes, 0.0)[ONE] == 1.0
    assert hidden(two_causes, 1.0)[ONE] > 1.0 - 1e-4
