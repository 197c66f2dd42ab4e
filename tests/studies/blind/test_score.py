"""Scores of labels and answers made by hand, whose counts are known."""

import numpy as np
import pytest

from docs.studies.blind.score import (
    answers,
    expected_calibration_error,
    figures,
    is_correct,
    is_tied,
    score_trial,
)
from docs.studies.blind.study import AT_LEAST, AT_MOST, rows
from docs.studies.blind.truth import ABSORBED


def label(kind="one", effects=("eddy_current",), visible=None, explainable=2.0, trial=0):
    """Content of sealed.json, as far as scores read it."""
    return {
        "trial": trial, "kind": kind, "effects": list(effects),
        "visible": list(effects if visible is None else visible),
        "gap": {"explainable": explainable},
    }  # fmt: skip


NOTHING = label("none", (), explainable=1.0)


def answer(verdict="known", *causes, component="solenoid", named=1):
    """Content of gap.json, as far as scores read it.

    causes: (effects, probability) in order; the first `named` are the ambiguity set.
    """
    return {
        "verdict": verdict,
        "where": {"component": {component: 0.9, "flow": 0.1} if component else {}},
        "causes": [{"effects": list(effects), "probability": p} for effects, p in causes],
        "ambiguity_set": [list(effects) for effects, _ in causes[:named]],
        "seconds": 10.0,
    }


EDDY = (["eddy_current"], 0.9)
CLAMP = (["flyback_voltage"], 0.08)
BOTH = ["eddy_current", "flyback_voltage"]
PAIR = label("pair", BOTH)
RIGHT = ("named_right", "truth_in_set", "component_right", "well_judged")
STRUCK = label("left_out", ["flow_force"])


def counts(trials):
    return {name: (f["hits"], f["of"]) for name, f in figures(trials).items() if "of" in f}


def test_the_right_cause():
    found = score_trial(label(), answer("known", EDDY, CLAMP))
    assert all(found[name] for name in RIGHT)
    assert (found["set_size"], found["probability"], found["tied"]) == (1, 0.9, False)
    second = score_trial(label(effects=["flyback_voltage"]), answer("ambiguous", EDDY, CLAMP, named=2))
    assert (second["named_right"], second["truth_in_set"], second["set_size"]) == (False, True, 2)


def test_the_wrong_cause():
    found = score_trial(label(effects=["seat_leak"]), answer("known", EDDY))
    assert not any(found[name] for name in RIGHT)
    assert (found["probability"], found["false_name"]) == (0, True)


def test_the_order_of_a_pair_does_not_matter_and_a_hidden_effect_need_not_be_named():
    pair = label("pair", ["seat_leak", "coil_heating"])
    assert is_correct(pair, ["coil_heating", "seat_leak"])
    assert not is_correct(pair, ["seat_leak"])
    hidden = label("pair", ["seat_leak", "coil_heating"], visible=["seat_leak"])
    assert is_correct(hidden, ["seat_leak"])
    assert is_correct(hidden, ["coil_heating", "seat_leak"])
    assert not is_correct(hidden, ["coil_heating"])
    assert not is_correct(hidden, ["seat_leak", "flow_force"])


def test_partial_is_right_if_the_set_that_it_names_is_the_truth():
    whole = score_trial(PAIR, answer("partial", (BOTH, 0.6), EDDY))
    assert (whole["named"], whole["named_right"], whole["truth_in_set"]) == (BOTH, True, True)
    half = score_trial(PAIR, answer("partial", EDDY, (BOTH, 0.05)))
    assert (half["named"], half["named_right"], half["false_name"]) == (["eddy_current"], False, False)


@pytest.mark.parametrize(("second", "tied"), [(0.4005, True), (0.398, False)])
def test_a_first_cause_within_a_thousandth_of_the_next_is_tied_and_counts_as_wrong(second, tied):
    said = answer("ambiguous", (["eddy_current"], 0.401), (["flyback_voltage"], second), named=2)
    assert is_tied(label(), said) is tied
    counted = counts([score_trial(label(), said)])
    assert counted["First cause right (a tie counts as wrong)"] == (int(not tied), 1)


def test_without_effect_any_verdict_but_no_gap_is_a_false_alarm():
    said = ["no_gap", "no_gap", "known", "ambiguous", "unknown"]
    found = [score_trial(NOTHING, answer(verdict, EDDY)) for verdict in said]
    assert counts(found)["False alarms without an effect"] == (3, 5)


def test_what_the_four_absorb_is_counted_apart():
    hidden = label(visible=[], explainable=1.001)
    found = [score_trial(hidden, answer(v, EDDY)) for v in ("no_gap", "known")]
    assert [trial["kind"] for trial in found] == [ABSORBED] * 2
    assert counts(found)["No gap where recalibration absorbs the cause"] == (1, 2)
    assert counts(found)["First cause right (a tie counts as wrong)"] == (0, 0)


def test_a_struck_effect_may_be_doubted_but_neither_overlooked_nor_surely_replaced():
    said = [
        answer("unknown", EDDY, component="protection_valve"), answer("partial", EDDY),
        answer("ambiguous", EDDY, CLAMP), answer("known", EDDY), answer("no_gap", component=""), None,
    ]  # fmt: skip
    found = [score_trial(STRUCK, one) for one in said]
    assert [trial["well_judged"] for trial in found] == [True, True, True, False, False, False]
    counted = counts(found)
    assert counted["Effect struck from the catalogue: not `known`"] == (3, 6)
    assert counted["Gap detected"] == (4, 6)
    assert counted["Diagnosis failed"] == (1, 6)


def study():
    """Ten trials with one cause: nine found, one missed; one without an effect; one that failed."""
    found = [score_trial(label(trial=i), answer("known", EDDY)) for i in range(9)]
    found.append(score_trial(label(trial=9, explainable=1.05), answer("no_gap", component="")))
    return found


def test_shares_means_and_what_is_asked_of_a_study():
    found = figures(study())
    assert found["Truth in the ambiguity set"]["hits"] == found["Gap detected"]["hits"] == 9
    assert found["Mean probability on the truth"]["value"] == pytest.approx(0.81)
    cells = {name: (result, asked) for name, result, asked in rows(found, "usual")}
    assert cells["Truth in the ambiguity set"] == ("9 of 10: **0.9** (0.55 to 1)", "at least 0.96")
    assert cells["Mean size of the ambiguity set"] == ("1", "at most 1.5")
    assert cells["False alarms without an effect"] == ("0 of 0: - (0 to 1)", "at most 0")
    assert (AT_LEAST | AT_MOST).keys() <= cells.keys()
    assert dict(zip(cells, rows(found, "strong"), strict=True))["Component right"][2] == "at least 0.95"


def error(probabilities, truths):
    return expected_calibration_error(np.array(probabilities), np.array(truths, dtype=bool))


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
