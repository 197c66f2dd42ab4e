"""Scores of labels and answers made by hand, whose counts are known."""

import json

import pytest

from identification.studies.blind.acceptance import ACCEPTANCE_CRITERIA
from identification.studies.blind.answers import is_correct
from identification.studies.blind.blind_section import blind_json, blind_section
from identification.studies.blind.detection import detection_by_gap
from identification.studies.blind.gap_reduction import GapReduction, rival_distance
from identification.studies.blind.kinds import ABSORBED
from identification.studies.blind.score import score_trial
from identification.studies.blind.settings import STRONG
from identification.studies.blind.summary import (
    is_well_judged,
    means,
    proportions,
    verdict_matrix,
)
from identification.studies.proportion import Proportion
from tests.identification.studies.blind.hand_made import CLAMP, EDDY, NOTHING, answer, label


def score(label, answer, reduction=None, rival=None):
    return score_trial(label, answer, reduction, rival)


def test_the_right_cause():
    found = score(label(sizes={"G_eddy": 2e-3}), answer("known", EDDY, CLAMP))
    assert all((found.first_cause_correct, found.truth_in_set, found.component_correct))
    assert found.set_size == 1
    assert found.probability == 0.9
    assert found.size_estimates[0].error == pytest.approx(0.1)
    assert found.size_estimates[0].inside
    assert is_well_judged(found)


def test_the_wrong_cause():
    found = score(label(effects=["seat_leak"]), answer("known", EDDY))
    assert not any(
        (found.first_cause_correct, found.truth_in_set, found.component_correct, is_well_judged(found))
    )
    assert (found.probability, found.size_estimates) == (0, ())


def test_a_truth_that_is_second_in_the_set():
    found = score(label(effects=["flyback_voltage"]), answer("ambiguous", EDDY, CLAMP, named=2))
    assert (found.first_cause_correct, found.truth_in_set, found.set_size) == (False, True, 2)


def test_a_tie_that_no_test_could_decide_is_counted_apart():
    """Whether chance put the truth first in it or not."""
    second, first = (label(effects=[cause]) for cause in ("flyback_voltage", "eddy_current"))
    tied = answer("ambiguous", EDDY, CLAMP, named=2)
    found = [score(second, tied, rival=0.4), score(first, tied, rival=0.4)]
    found += [score(second, tied, rival=5.0), score(first, answer("known", EDDY))]
    counted = proportions(found)
    assert counted["first cause right"] == Proportion(hits=2, of=4)
    assert counted["first cause right, where data can tell"] == Proportion(hits=1, of=2)


def test_only_a_cause_that_lacks_some_of_the_truth_is_its_rival():
    both = ["eddy_current", "flyback_voltage"], 0.1, {"G_eddy_S": [2e-3, 1e-3, 3e-3]}
    truth = label(effects=["eddy_current"])
    assert rival_distance(truth, answer("known", EDDY), []) is None
    assert rival_distance(truth, answer("ambiguous", EDDY, both, named=2), []) is None
    assert rival_distance(truth, answer("ambiguous", CLAMP, both, named=1), []) is None
    assert rival_distance(truth, None, []) is None


def test_the_order_of_a_pair_does_not_matter_and_a_hidden_effect_need_not_be_named():
    pair = label("pair", ["seat_leak", "coil_heating"])
    assert is_correct(pair, ["coil_heating", "seat_leak"])
    assert not is_correct(pair, ["seat_leak"])
    hidden = label("pair", ["seat_leak", "coil_heating"], visible=["seat_leak"])
    assert is_correct(hidden, ["seat_leak"])
    assert is_correct(hidden, ["coil_heating", "seat_leak"])
    assert not is_correct(hidden, ["coil_heating"])
    assert not is_correct(hidden, ["seat_leak", "flow_force"])


def test_a_parameter_s_error_is_relative_to_how_far_it_is_off():
    cause = (["parameter:d1"], 0.9, {"d1_m": [0.01845, 0.0184, 0.0185]})
    found = score(label(effects=["parameter:d1"], sizes={"d1": 0.0185}), answer("known", cause))
    assert found.size_estimates[0].error == pytest.approx(0.1)


def test_without_effect_any_verdict_but_no_gap_is_a_false_alarm():
    said = ["no_gap", "no_gap", "known", "ambiguous", "unknown"]
    found = [score(NOTHING, answer(verdict, EDDY)) for verdict in said]
    assert proportions(found)["false alarms without an effect"] == Proportion(hits=3, of=5)


def test_what_the_four_absorb_is_counted_apart():
    hidden = label(visible=[], explainable=1.001)
    found = [score(hidden, answer(v, EDDY)) for v in ("no_gap", "known")]
    assert [trial.kind for trial in found] == [ABSORBED] * 2
    counted = proportions(found)
    assert counted["no gap where the four absorb it"] == Proportion(hits=1, of=2)
    assert counted["false cause where the four absorb it"] == Proportion(
        hits=0, of=2
    )  # it was the truth
    assert counted["first cause right"].of == 0


def test_unknown_is_correct_where_the_effect_is_excluded():
    struck = label("left_out", ["flow_force"])
    found = [
        score(struck, answer("unknown", EDDY, component="protection_valve")),
        score(struck, answer("known", EDDY)),
        score(struck, answer("no_gap", component="")),
        score(struck, None),
    ]
    counted = proportions(found)
    assert counted["unknown where the effect is struck"] == Proportion(hits=1, of=4)
    assert counted["component right where the effect is struck"] == Proportion(hits=1, of=4)
    assert counted["detected"] == Proportion(hits=2, of=4)
    assert counted["failed"] == Proportion(hits=1, of=4)


def study():
    """Ten trials: nine single causes right and one missed, with intervals of the gap reduction."""
    inside, outside = (
        GapReduction(true=0.95, low=0.9, high=1.0),
        GapReduction(true=0.5, low=0.9, high=1.0),
    )
    right = [
        score(label(trial=i, sizes={"G_eddy": 2e-3}), answer("known", EDDY), inside) for i in range(8)
    ]
    right.append(score(label(trial=8, sizes={"G_eddy": 4e-3}), answer("known", EDDY), outside))
    return [*right, score(label(trial=9, explainable=1.05), answer("no_gap", component=""))]


def test_shares_and_means_of_a_study():
    counted, mean = proportions(study()), means(study())
    assert counted["first cause right"] == counted["detected"] == Proportion(hits=9, of=10)
    assert counted["size inside its interval"] == Proportion(hits=8, of=9)
    assert counted["shrink inside its 90 % interval"] == Proportion(hits=8, of=9)
    assert mean["mean probability on the truth"] == pytest.approx(0.81)
    assert mean["mean size of the ambiguity set"] == 1.0
    assert mean["median relative error of a size"] == pytest.approx(0.1)
    assert verdict_matrix(study()).sum() == 10


def test_acceptance_criteria_are_met_or_not():
    found = blind_json(study(), seed=0)["bars"]
    assert found["first cause right, ties counted as wrong"] is True
    assert found["truth in the ambiguity set"] is False
    assert found["false alarms without an effect"] is None
    assert set(found) == {criterion.name for criterion in ACCEPTANCE_CRITERIA}


def test_strong_forms_are_asked_for_calibration_alone():
    """Nine right answers of 0.9 each: the error is 0.1."""
    found = blind_json(study(), seed=0, settings=STRONG)
    assert found["bars"] == {"calibration error of the first cause": False}
    assert found["calibration"]["first cause"]["ece"]["equal width"]["value"] == pytest.approx(0.1)
    assert found["forms"] == "strong"


def test_the_bars_are_those_of_the_best_study_or_above():
    bars = {criterion.name: (criterion.least, criterion.most) for criterion in ACCEPTANCE_CRITERIA}
    assert bars["false alarms without an effect"][1] == 0
    assert bars["truth in the ambiguity set"][0] == 0.96
    assert bars["first cause right, ties counted as wrong"][0] == 0.90
    assert bars["unknown where the effect is struck"][0] == 0.87
    assert bars["calibration error of the first cause"][1] == 0.05


def test_detection_is_counted_by_size_of_the_gap():
    bins = {bin_.low: bin_ for bin_ in detection_by_gap(study()) if bin_.detected.of}
    assert bins[0.03].detected == Proportion(hits=0, of=1)
    assert bins[1.0].first_cause_correct == Proportion(hits=9, of=9)


def test_intervals_are_exact():
    """No hit in n: the upper end is 1 - 0.025^(1/n)."""
    low, high = Proportion(hits=0, of=60).interval
    assert (low, high) == pytest.approx((0.0, 1 - 0.025 ** (1 / 60)))
    assert Proportion(hits=0, of=0).value is None


def test_a_study_is_written_down():
    trials = [*study(), score(NOTHING, answer("no_gap", component="")), score(label(), None)]
    section = blind_section(trials)
    assert len(section.verdicts) == len(ACCEPTANCE_CRITERIA)
    json.dumps(blind_json(trials, seed=0), allow_nan=False)
