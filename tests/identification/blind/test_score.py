"""Scores of labels and answers made by hand, whose counts are known."""

import json

import pytest

from identification.blind.report import CRITERIA, as_text, reliability_figure, results
from identification.blind.score import (
    held_effects,
    is_correct,
    is_tied,
    is_true,
    is_well_judged,
    named_cause,
    named_set,
    score_trial,
    share,
    shares,
)
from identification.blind.truth import ABSORBED
from tests.identification.blind.hand_made import CLAMP, EDDY, NOTHING, answer, label

BOTH = ["eddy_current", "flyback_voltage"]
PAIR = label("pair", BOTH)
STRUCK = label("left_out", ["flow_force"])


def partial(**inclusion):
    """A `partial` that lists the pair first."""
    return answer("partial", (BOTH, 0.6), EDDY, named=0, inclusion=inclusion)


def counts(trials):
    return {name: (found["hits"], found["of"]) for name, found in shares(trials).items()}


def test_the_right_cause():
    found = score_trial(label(), answer("known", EDDY, CLAMP))
    assert all((found.named_right, found.truth_in_set, found.component_right, is_well_judged(found)))
    assert (found.set_size, found.probability, found.tied) == (1, 0.9, False)
    second = score_trial(label(effects=["flyback_voltage"]), answer("ambiguous", EDDY, CLAMP, named=2))
    assert (second.named_right, second.truth_in_set, second.set_size) == (False, True, 2)


def test_the_wrong_cause():
    found = score_trial(label(effects=["seat_leak"]), answer("known", EDDY))
    assert not any((found.named_right, found.truth_in_set, found.component_right, is_well_judged(found)))
    assert (found.probability, found.false_held) == (0, ("eddy_current",))


def test_the_order_of_a_pair_does_not_matter_and_a_hidden_effect_need_not_be_named():
    pair = label("pair", ["seat_leak", "coil_heating"])
    assert is_correct(pair, ["coil_heating", "seat_leak"])
    assert not is_correct(pair, ["seat_leak"])
    hidden = label("pair", ["seat_leak", "coil_heating"], visible=["seat_leak"])
    assert is_correct(hidden, ["seat_leak"])
    assert is_correct(hidden, ["coil_heating", "seat_leak"])
    assert not is_correct(hidden, ["coil_heating"])
    assert not is_correct(hidden, ["seat_leak", "flow_force"])


def test_effects_are_held_from_nine_tenths_the_surest_first():
    said = partial(eddy_current=0.9, flow_force=0.95, seat_leak=0.899)
    assert held_effects(said) == named_cause(said) == ("flow_force", "eddy_current")


def test_partial_is_right_if_what_it_holds_is_the_truth():
    whole = score_trial(PAIR, partial(eddy_current=0.99, flyback_voltage=0.92))
    assert (whole.named, whole.named_right, whole.truth_in_set) == (tuple(BOTH), True, True)
    half = score_trial(PAIR, partial(eddy_current=0.99, flyback_voltage=0.6))
    assert (half.named, half.named_right) == (("eddy_current",), False)


def test_an_ambiguity_set_of_a_partial_counts_as_it_is_given():
    given = partial(eddy_current=0.99) | {"ambiguity_set": [BOTH, ["eddy_current"]]}
    assert named_set(given) == [tuple(BOTH), ("eddy_current",)]
    assert named_set(partial(eddy_current=0.99)) == [("eddy_current",)]
    assert named_set(partial(eddy_current=0.5)) == []
    assert named_set(answer("unknown", EDDY)) == []


@pytest.mark.parametrize(("second", "tied"), [(0.4005, True), (0.398, False)])
def test_a_first_cause_within_a_thousandth_of_the_next_is_tied_and_counts_as_wrong(second, tied):
    said = answer("ambiguous", (["eddy_current"], 0.401), (["flyback_voltage"], second), named=2)
    assert is_tied(label(), said) is tied
    counted = counts([score_trial(label(), said)])
    assert counted["first cause right"] == (1, 1)
    assert counted["first cause right, ties counted as wrong"] == (int(not tied), 1)


def test_two_right_causes_do_not_tie():
    hidden = label("pair", BOTH, visible=["eddy_current"])
    said = answer("ambiguous", (["eddy_current"], 0.45), (BOTH, 0.45), named=2)
    assert not is_tied(hidden, said)
    assert is_tied(label(), said)


def test_an_absorbed_effect_that_is_named_is_true_though_there_was_nothing_to_explain():
    absorbed = label("pair", BOTH, visible=[])
    assert is_true(absorbed, ["eddy_current"])
    assert not is_true(absorbed, ["flow_force"])
    assert not is_true(absorbed, [])
    assert not is_true(NOTHING, ["eddy_current"])


def test_without_effect_any_verdict_but_no_gap_is_a_false_alarm():
    said = ["no_gap", "no_gap", "known", "ambiguous", "unknown"]
    found = [score_trial(NOTHING, answer(verdict, EDDY)) for verdict in said]
    assert counts(found)["false alarms without an effect"] == (3, 5)


def test_what_the_four_absorb_is_counted_apart():
    hidden = label(visible=[], explainable=1.001)
    found = [score_trial(hidden, answer(v, EDDY)) for v in ("no_gap", "known")]
    assert [trial.kind for trial in found] == [ABSORBED] * 2
    assert counts(found)["no gap where the four absorb it"] == (1, 2)
    assert counts(found)["first cause right"] == (0, 0)


def test_a_struck_effect_may_be_left_open_but_not_replaced():
    said = [
        answer("unknown", EDDY, component="protection_valve"), partial(eddy_current=0.5),
        partial(eddy_current=0.95), answer("known", EDDY), answer("no_gap", component=""), None,
    ]  # fmt: skip
    found = [score_trial(STRUCK, one) for one in said]
    assert [is_well_judged(trial) for trial in found] == [True, True, False, False, False, False]
    counted = counts(found)
    assert counted["unknown where the effect is struck"] == (2, 6)
    assert counted["component right where the effect is struck"] == (1, 6)
    assert counted["detected"] == (4, 6)
    assert counted["failed"] == (1, 6)


def test_intervals_are_exact():
    """No hit in n: the upper end is 1 - 0.025^(1/n)."""
    found = share([False] * 60)
    assert (found["low"], found["high"]) == pytest.approx((0.0, 1 - 0.025 ** (1 / 60)))
    assert share([])["value"] is None


def study():
    """Ten trials with one cause: nine found, one missed; one without an effect; one that failed."""
    found = [score_trial(label(trial=i), answer("known", EDDY)) for i in range(9)]
    found.append(score_trial(label(trial=9, explainable=1.05), answer("no_gap", component="")))
    return found


def test_shares_means_and_criteria_of_a_study():
    found = results(study(), seed=0, forms="usual")
    assert found["shares"]["first cause right"]["hits"] == found["shares"]["detected"]["hits"] == 9
    assert found["means"]["mean probability on the truth"] == pytest.approx(0.81)
    met = {name: criterion["met"] for name, criterion in found["criteria"].items()}
    assert met["first cause right, ties counted as wrong"] is True
    assert met["truth in the ambiguity set"] is False
    assert met["false alarms without an effect"] is None
    assert set(met) == set(CRITERIA)


def test_strong_forms_are_asked_for_calibration_alone():
    """Nine right answers of 0.9 each: the error is 0.1."""
    found = results(study(), seed=0, forms="strong")
    error = found["criteria"].pop("calibration error of the first cause")
    assert (error["value"], error["met"]) == (pytest.approx(0.1), False)
    assert found["criteria"] == {}


def test_a_study_is_written_down():
    trials = [*study(), score_trial(NOTHING, answer("no_gap", component="")), score_trial(label(), None)]
    found = results(trials, seed=0, forms="usual")
    json.dumps(found, allow_nan=False)
    text = as_text(found)
    assert "trial 0009: eddy_current; no_gap, named: nothing" in text
    assert "component right at least 0.95" in text
    assert [axes.get_title() for axes in reliability_figure(found["calibration"]).axes] == [
        "first cause", "inclusion of an effect",
    ]  # fmt: skip
