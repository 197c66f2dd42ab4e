"""Calibration of answers made by hand and by chance."""

import numpy as np
import pytest

from docs.studies.blind.score import answers, expected_calibration_error, score_trial
from tests.studies.blind.hand_made import CLAMP, EDDY, NOTHING, answer, label


def error(probabilities, truths):
    return expected_calibration_error(np.array(probabilities), np.array(truths, dtype=bool))


def test_a_calibrated_judge_has_hardly_an_error():
    """Statements of probability p that come true with probability p; chance leaves about 0.01."""
    rng = np.random.default_rng(0)
    p = rng.uniform(size=20_000)
    assert error(p, rng.uniform(size=p.size) < p) < 0.02


def test_an_overconfident_judge_has_the_error_that_hands_compute():
    """Of 39 answers at 0.995, 33 are right; of 16 at 0.91, 13: both lie in the topmost bin.

    A judge who is too sure in one bin and not sure enough in another errs in both.
    """
    sure = error([0.995] * 39 + [0.91] * 16, [1] * 33 + [0] * 6 + [1] * 13 + [0] * 3)
    assert sure == pytest.approx((53.365 - 46) / 55)
    mixed = error([0.95] * 10 + [0.55] * 10, [1] * 8 + [0] * 2 + [1] * 9 + [0])
    assert mixed == pytest.approx((1.5 + 3.5) / 20)


def test_a_named_cause_is_wrong_where_none_is_right():
    """Named right, named where nothing is, named for a struck effect, and not named."""
    said = [
        (label(), answer("known", EDDY, CLAMP)),
        (NOTHING, answer("known", EDDY)),
        (label("left_out", ["flow_force"]), answer("ambiguous", CLAMP)),
        (label(), answer("unknown", EDDY)),
        (NOTHING, answer("no_gap", (["eddy_current"], 0.005))),
        (label(), None),
    ]
    trials = [score_trial(*pair) for pair in said]
    probability, right = answers(trials)
    assert (list(probability), list(right)) == ([0.9, 0.9, 0.08], [True, False, False])
