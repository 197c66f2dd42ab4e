"""The predictive check: what a black box predicts of a cause's residual may overrule the evidence."""

from dataclasses import replace

import numpy as np
import pytest

from identification.gap.diagnosis import diagnose
from identification.gap.rank.predictive_check import check_predictively
from identification.gap.rank.ranking import Ranking
from identification.gap.rank.settings import RankingSettings
from identification.gap.rank.verdict import AMBIGUOUS, KNOWN, NO_GAP, UNKNOWN
from identification.gap.reduce.discrepancy_reduction import Unexplained
from tests.identification.gap.tanks import TANKS, diagnosed


def left(fraction: float, *, predictable: bool) -> Unexplained:
    return Unexplained(
        fraction=fraction,
        predictable=0.5 if predictable else 0.0,
        p_value=0.001 if predictable else 0.8,
        still_predictable=predictable,
    )


SETTINGS = RankingSettings()
FAR, CLOSE = 2 * SETTINGS.near_floor_share, SETTINGS.near_floor_share / 2


def total(ranking: Ranking) -> float:
    return ranking.no_cause + ranking.unknown + sum(ranking.probabilities)


@pytest.mark.parametrize("verdict", [KNOWN, AMBIGUOUS])
def test_a_named_cause_that_leaves_much_to_predict_is_doubted(verdict):
    sure = diagnosed(KNOWN).ranking
    found = check_predictively(sure, verdict, left(FAR, predictable=True))
    assert found.unknown == SETTINGS.contradicted_unknown
    assert total(found) == pytest.approx(1.0)
    assert np.argmax(found.probabilities) == np.argmax(sure.probabilities)


def test_a_cause_near_the_floor_that_leaves_nothing_to_predict_is_named():
    lost = replace(diagnosed(KNOWN).ranking, unknown=1.0, no_cause=0.0)
    found = check_predictively(lost, UNKNOWN, left(CLOSE, predictable=False))
    assert found.unknown == SETTINGS.confirmed_unknown
    assert total(found) == pytest.approx(1.0)
    assert found.probabilities[0] > 0.5


@pytest.mark.parametrize(
    ("verdict", "fraction", "predictable"),
    [
        (KNOWN, CLOSE, True),
        (KNOWN, FAR, False),
        (UNKNOWN, FAR, False),
        (UNKNOWN, CLOSE, True),
        (NO_GAP, FAR, True),
    ],
)
def test_without_a_contradiction_nothing_changes(verdict, fraction, predictable):
    found = diagnosed(KNOWN).ranking
    assert check_predictively(found, verdict, left(fraction, predictable=predictable)) is found


def test_a_diagnosis_says_what_the_predictive_check_found(monkeypatch):
    monkeypatch.setattr(
        "identification.gap.diagnosis.check_predictively",
        lambda ranking, *_: check_predictively(ranking, KNOWN, left(FAR, predictable=True)),
    )
    found = diagnose(TANKS[KNOWN]())
    assert found.conclusion.verdict == UNKNOWN
    assert found.remaining is not None
