"""What a black box finds in the first cause's leftover may overrule the evidence."""

from dataclasses import replace

import numpy as np
import pytest

from identification.gap.diagnosis import diagnose
from identification.gap.rank.predictive_check import DOUBTED, NEAR, TRUSTED, second_look
from identification.gap.rank.ranking import Verdicts
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


FAR, CLOSE = 2 * NEAR, NEAR / 2


def total(verdicts: Verdicts) -> float:
    return verdicts.no_cause + verdicts.unknown + sum(verdicts.probability)


@pytest.mark.parametrize("verdict", [KNOWN, AMBIGUOUS])
def test_a_named_cause_that_leaves_much_to_predict_is_doubted(verdict):
    sure = diagnosed(KNOWN).verdicts
    found = second_look(sure, verdict, left(FAR, predictable=True))
    assert found.unknown == DOUBTED
    assert total(found) == pytest.approx(1.0)
    assert np.argmax(found.probability) == np.argmax(sure.probability)


def test_a_cause_near_the_floor_that_leaves_nothing_to_predict_is_named():
    lost = replace(diagnosed(KNOWN).verdicts, unknown=1.0, no_cause=0.0)
    found = second_look(lost, UNKNOWN, left(CLOSE, predictable=False))
    assert found.unknown == TRUSTED
    assert total(found) == pytest.approx(1.0)
    assert found.probability[0] > 0.5


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
    found = diagnosed(KNOWN).verdicts
    assert second_look(found, verdict, left(fraction, predictable=predictable)) is found


def test_a_diagnosis_says_what_the_second_look_found(monkeypatch):
    monkeypatch.setattr(
        "identification.gap.diagnosis.second_look",
        lambda verdicts, *_: second_look(verdicts, KNOWN, left(FAR, predictable=True)),
    )
    found = diagnose(TANKS[KNOWN]())
    assert found.conclusion.verdict == UNKNOWN
    assert found.left is not None
