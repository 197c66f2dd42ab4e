"""A true cause beside something without a name: it is held and to be added, and the rest is said."""

from functools import cache

import pytest

from identification.gap.diagnosis import Diagnosis, diagnose
from identification.gap.sentences import verdict_sentence
from identification.gap.verdict import NO_GAP, PARTIAL
from tests.identification.gap.drives import Drive
from tests.identification.gap.tanks import diagnosed, leaking, without_gap
from tests.identification.gap.test_ranking import stating


@cache
def beside_a_lag() -> Diagnosis:
    """A coupling that closes two thirds of the gap, and a lag that the catalogue lacks."""
    return diagnose(Drive({"coupling": 0.3, "lag": 0.02}, names=("coupling", "limit", "drift")))


def test_a_true_cause_that_closes_a_part_of_the_gap_is_held():
    found = beside_a_lag()
    assert found.conclusion.verdict == PARTIAL
    assert found.conclusion.held == ("coupling",)
    assert 0.5 < found.reduction.shares_closed["coupling"].value < 0.9


def test_it_is_advised_to_add_what_helps():
    text = verdict_sentence(beside_a_lag(), "")[1]
    assert text.startswith("coupling is part of the gap (")
    assert text.endswith("add coupling.")
    assert "do not add" not in text


def test_what_remains_is_located():
    """Without equations the lag can only lie in the reading or in its time."""
    found = beside_a_lag()
    assert found.remaining is not None
    assert max(found.remaining.equation_probabilities.values()) > 0.5


@pytest.mark.parametrize("factor", [0.3, 3.0])
def test_the_verdict_does_not_hinge_on_the_stated_noise(factor):
    assert diagnose(stating(without_gap(), factor)).conclusion.verdict == NO_GAP
    found, right = diagnose(stating(leaking(), factor)), diagnosed("known")
    assert found.conclusion.verdict == right.conclusion.verdict
    assert found.conclusion.causes[0].effects == right.conclusion.causes[0].effects
