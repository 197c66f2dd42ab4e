"""Calibration of answers made by hand and by chance."""

import json
from dataclasses import replace

import numpy as np
import pytest

from identification.studies.blind.blind_figures import FIGURES
from identification.studies.blind.calibration import (
    EQUAL_MASS,
    EQUAL_WIDTH,
    FIRST,
    INCLUSION,
    LISTED,
    answers_by_trial,
    calibration_errors,
    equal_mass_bins,
    equal_width_bins,
    expected_calibration_error,
    reliability,
)
from identification.studies.blind.calibration_section import calibration_blocks, calibration_json
from identification.studies.blind.score import Answer, score_trial
from identification.studies.blind.settings import DEFAULTS
from tests.identification.studies.blind.hand_made import CLAMP, EDDY, NOTHING, answer, label


def groups(probabilities, truths):
    """One answer per trial."""
    return [[Answer(probability=p, right=bool(r))] for p, r in zip(probabilities, truths, strict=True)]


def trial(label, answer):
    return score_trial(label, answer, None)


def test_a_calibrated_judge_has_hardly_an_error():
    """Statements of probability p that come true with probability p; chance leaves about 0.01."""
    rng = np.random.default_rng(0)
    p = rng.uniform(size=20_000)
    right = rng.uniform(size=p.size) < p
    few = replace(DEFAULTS, bootstrap_draws=10)  # the error itself needs no interval
    errors = calibration_errors(groups(p, right), few)
    assert errors[EQUAL_WIDTH].value < 0.02
    assert errors[EQUAL_MASS].value < 0.02


def test_answers_as_often_right_as_they_say_have_no_error():
    """Of ten at 0.7 seven are right, of five at 0.2 one."""
    found = groups([0.7] * 10 + [0.2] * 5, [1] * 7 + [0] * 3 + [1] + [0] * 4)
    assert calibration_errors(found)[EQUAL_WIDTH].value == pytest.approx(0.0)


def test_an_overconfident_judge_has_the_error_that_hands_compute():
    """Of 39 answers at 0.995, 33 are right; of 16 at 0.91, 13: |38.805 - 33|/55 + |14.56 - 13|/55.

    Both lie in the topmost of ten bins of equal width, where it is |53.365 - 46|/55 as well. A judge who
    is too sure in one bin and not sure enough in another errs in both.
    """
    sure = groups([0.995] * 39 + [0.91] * 16, [1] * 33 + [0] * 6 + [1] * 13 + [0] * 3)
    assert calibration_errors(sure)[EQUAL_WIDTH].value == pytest.approx((53.365 - 46) / 55)
    mixed = groups([0.95] * 10 + [0.55] * 10, [1] * 8 + [0] * 2 + [1] * 9 + [0])
    assert calibration_errors(mixed)[EQUAL_WIDTH].value == pytest.approx((1.5 + 3.5) / 20)


def test_bins_of_equal_mass_see_what_one_wide_bin_averages_away():
    """Answers at 0.99 that are never right hide among those at 0.91 that always are."""
    p = np.array([0.91] * 90 + [0.99] * 10)
    right = np.array([True] * 90 + [False] * 10)
    wide = expected_calibration_error(p, right, equal_width_bins(p, 10))
    even = expected_calibration_error(p, right, equal_mass_bins(p, 10))
    assert wide == pytest.approx(abs(0.91 * 90 + 9.9 - 90) / 100)
    assert even == pytest.approx(0.9 * 0.09 + 0.1 * 0.99)


def test_bins_hold_every_answer_once_and_their_edges():
    p = np.array([0.0, 0.1, 0.99, 1.0, 0.5])
    for bins in (equal_width_bins(p, 10), equal_mass_bins(p, 3)):
        assert sorted(np.concatenate(bins).tolist()) == list(range(len(p)))
    assert [inside.tolist() for inside in equal_width_bins(p, 10)] == [[0], [1], [4], [2, 3]]


def test_the_interval_holds_the_error_and_draws_whole_trials():
    """Ten copies of each trial's one answer say no more than one."""
    rng = np.random.default_rng(1)
    p = rng.uniform(0.5, 1.0, 60)
    right = rng.uniform(size=60) < p - 0.3
    one = calibration_errors(groups(p, right))[EQUAL_WIDTH]
    ten = calibration_errors([group * 10 for group in groups(p, right)])[EQUAL_WIDTH]
    assert one.low < one.value < one.high
    assert (ten.value, ten.low, ten.high) == pytest.approx((one.value, one.low, one.high))


def test_a_reliability_bin_has_its_mean_and_its_share():
    (bin_,) = reliability(groups([0.82, 0.88, 0.86], [1, 1, 0]))
    assert bin_.mean_probability == pytest.approx(0.8533, abs=1e-4)
    assert (bin_.right.hits, bin_.right.of) == (2, 3)


def study():
    """Named right, named where nothing is, named for a struck effect, and not named."""
    return [
        trial(label(), answer("known", EDDY, CLAMP)),
        trial(NOTHING, answer("known", EDDY)),
        trial(label("left_out", ["flow_force"]), answer("ambiguous", CLAMP)),
        trial(label(), answer("unknown", EDDY)),
        trial(NOTHING, answer("no_gap", (["eddy_current"], 0.005, {}))),
        trial(label(), None),
    ]


def test_a_named_cause_is_wrong_where_none_is_right_and_unnamed_ones_are_counted_apart():
    found = answers_by_trial(study())
    first = [(a.probability, a.right) for (a,) in found[FIRST]]
    assert first == [(0.9, True), (0.9, False), (0.08, False)]
    listed = [(a.probability, a.right) for (a,) in found[LISTED]]
    assert listed == [*first, (0.9, True), (0.005, False)]


def test_inclusion_leaves_out_what_is_below_a_hundredth():
    found = [[(a.probability, a.right) for a in group] for group in answers_by_trial(study())[INCLUSION]]
    assert found == [[(0.9, True), (0.08, False)], [(0.9, False)], [(0.08, False)], [(0.9, True)]]


def test_calibration_is_written_down_and_drawn():
    found = calibration_json(study())
    json.dumps(found, allow_nan=False)
    assert found[FIRST]["answers"] == 3
    assert found[FIRST]["overconfidence"] == pytest.approx((0.9 + 0.9 + 0.08 - 1) / 3)
    _, table = calibration_blocks(study())
    assert [row[0] for row in table.rows] == [FIRST, LISTED, INCLUSION]
    left, right = FIGURES["blind-reliability"](study()).axes
    assert (left.get_title(), right.get_title()) == (FIRST, INCLUSION)


def test_a_study_without_answers_has_no_error():
    empty = [trial(label(), None)]
    assert calibration_errors(answers_by_trial(empty)[FIRST]) == {}
    assert [row[1] for row in calibration_blocks(empty)[1].rows] == ["0", "0", "0"]
