"""What both versions of gap.json name: `partial`, held effects and ties."""

import pytest

from identification.studies.blind.answers import (
    held_effects,
    inclusion,
    is_tied,
    is_true,
    named_cause,
    named_set,
)
from identification.studies.blind.kinds import ABSORBED, KIND_TITLES
from identification.studies.blind.score import score_trial
from identification.studies.blind.summary import is_well_judged, proportions
from identification.studies.proportion import Proportion
from tests.identification.studies.blind.hand_made import CLAMP, EDDY, NOTHING, answer, label

BOTH = ["eddy_current", "flyback_voltage"]
PAIR = label("pair", BOTH)
STRUCK = label("left_out", ["flow_force"])


def partial(**shares):
    """A `partial` of version 2 that lists the pair first; shares: inclusion of effects."""
    return answer("partial", (BOTH, 0.6, {}), EDDY, named=0, inclusion=shares)


def score(label, answer):
    return score_trial(label, answer, None)


def test_version_1_has_the_sum_over_causes_for_inclusion():
    found = inclusion(answer("known", (["eddy_current"], 0.5, {}), (BOTH, 0.4, {})))
    assert found == pytest.approx({"eddy_current": 0.9, "flyback_voltage": 0.4})


def test_effects_are_held_from_nine_tenths_the_surest_first():
    shares = {"eddy_current": 0.9, "flow_force": 0.95, "seat_leak": 0.899}
    assert held_effects(partial(**shares)) == ("flow_force", "eddy_current")


def test_partial_names_what_is_held_and_is_right_if_that_is_the_truth():
    whole = score(PAIR, partial(eddy_current=0.99, flyback_voltage=0.92))
    assert (whole.first_cause, whole.first_cause_correct, whole.truth_in_set) == (
        tuple(BOTH),
        True,
        True,
    )
    half = score(PAIR, partial(eddy_current=0.99, flyback_voltage=0.6))
    assert (half.first_cause, half.first_cause_correct) == (("eddy_current",), False)
    more = score(label(), partial(eddy_current=0.99, flyback_voltage=0.92))
    assert (more.first_cause_correct, more.false_held) == (False, ("flyback_voltage",))


def test_an_ambiguity_set_of_a_partial_counts_as_it_is_given():
    given = partial(eddy_current=0.99) | {"ambiguity_set": [BOTH, ["eddy_current"]]}
    assert named_set(given) == [tuple(BOTH), ("eddy_current",)]
    assert named_set(partial(eddy_current=0.99)) == [("eddy_current",)]
    assert named_set(partial(eddy_current=0.5)) == []
    assert named_set(answer("unknown", EDDY)) == []


def test_no_cause_is_named_by_no_gap_and_unknown():
    assert [named_cause(answer(v, EDDY)) for v in ("no_gap", "unknown", "failed")] == [()] * 3


@pytest.mark.parametrize(("second", "tied"), [(0.4005, True), (0.398, False)])
def test_a_first_cause_within_a_thousandth_of_the_next_is_tied_and_counts_as_wrong(second, tied):
    said = answer("ambiguous", (["eddy_current"], 0.401, {}), (["flyback_voltage"], second, {}), named=2)
    assert is_tied(label(), said) is tied
    counted = proportions([score(label(), said)])
    assert counted["first cause right"] == Proportion(hits=1, of=1)
    assert counted["first cause right, ties counted as wrong"] == Proportion(hits=int(not tied), of=1)


def test_two_right_causes_do_not_tie():
    hidden = label("pair", BOTH, visible=["eddy_current"])
    said = answer("ambiguous", (["eddy_current"], 0.45, {}), (BOTH, 0.45, {}), named=2)
    assert not is_tied(hidden, said)
    assert is_tied(label(), said)


def test_a_struck_effect_may_be_left_partly_open_but_not_replaced():
    open_, replaced = partial(eddy_current=0.5), partial(eddy_current=0.95)
    found = [score(STRUCK, said) for said in (answer("unknown"), open_, replaced, answer("known", EDDY))]
    counted = proportions(found)
    assert counted["unknown where the effect is struck"] == Proportion(hits=2, of=4)
    assert [is_well_judged(trial) for trial in found] == [True, True, False, False]
    assert counted["detected"].hits == 4


def test_a_partial_without_an_effect_is_a_false_alarm():
    found = [score(NOTHING, partial(eddy_current=0.95)), score(NOTHING, answer("no_gap"))]
    assert proportions(found)["false alarms without an effect"] == Proportion(hits=1, of=2)


def test_false_held_effects_are_counted_by_kind():
    said = partial(eddy_current=0.95, flyback_voltage=0.91)
    found = [score(truth, said) for truth in (label(), PAIR, STRUCK, NOTHING)]
    counted = proportions(found)
    hits = {kind: counted[f"false effect held, {title}"].hits for kind, title in KIND_TITLES.items()}
    assert hits == {"none": 1, ABSORBED: 0, "one": 1, "pair": 0, "left_out": 1}
    assert counted["false effect held"] == Proportion(hits=3, of=4)
    assert found[2].false_held == tuple(BOTH)


def test_an_absorbed_effect_that_is_named_is_true_though_there_was_nothing_to_explain():
    absorbed = label("pair", BOTH, visible=[])
    assert is_true(absorbed, ["eddy_current"])
    assert not is_true(absorbed, ["flow_force"])
    assert not is_true(absorbed, [])
    assert not is_true(NOTHING, ["eddy_current"])
    assert not is_true(PAIR, ["eddy_current"])


def test_clamp_alone_is_not_the_truth_of_an_eddy_current():
    assert not score(label(), answer("known", CLAMP)).first_cause_correct
