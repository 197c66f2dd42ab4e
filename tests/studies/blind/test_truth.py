"""The drawn truths: reproducible, every effect as often, within its physical range."""

from collections import Counter

import numpy as np
import pytest

from docs.studies.blind.study import truth_label
from docs.studies.blind.truth import (
    CALIBRATED_SPREAD,
    EFFECTS,
    EXCLUDED_EFFECT,
    NOMINAL,
    ONE_CAUSE,
    TWO_EFFECTS,
    UNIT_SCATTER,
    UNIT_SCATTER_LIMIT,
    draw_trial,
    draw_unit,
    trial_plan,
)
from epv_env.plant.parameters import Parameters
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.valve_gap.causes import PARAMETER_COMPONENTS


def test_the_same_seed_draws_the_same_truth_and_another_another():
    assert trial_plan(3, 100) == trial_plan(3, 100) != trial_plan(4, 100)
    first, again, other = (draw_trial(seed, 5, ONE_CAUSE, ["flow_force"]) for seed in (3, 3, 4))
    assert first == again
    assert first.sizes != other.sizes


def test_kinds_come_in_the_shares_that_are_asked_for():
    assert Counter(kind for kind, _ in trial_plan(0, 300)) == {
        NOMINAL: 60,
        ONE_CAUSE: 150,
        TWO_EFFECTS: 36,
        EXCLUDED_EFFECT: 54,
    }


def first_causes(kind, count):
    """How often each cause comes up in the first trials of a kind."""
    drawn = [causes[0] for k, causes in trial_plan(0, 400) if k == kind]
    assert len(drawn) >= count
    return Counter(drawn[:count])


def test_every_effect_comes_up_alone_and_thrice_as_often_as_a_parameter():
    deck = 3 * len(EFFECTS) + len(PARAMETER_COMPONENTS)
    parameters = [f"parameter:{symbol}" for symbol in PARAMETER_COMPONENTS]
    expected = dict.fromkeys(EFFECTS, 3) | dict.fromkeys(parameters, 1)
    assert first_causes(ONE_CAUSE, deck) == expected


def drawn(effect, forms="usual", trials=200):
    return [draw_trial(0, number, ONE_CAUSE, [effect], forms) for number in range(trials)]


@pytest.mark.parametrize("effect", ["supply_restriction", "magnetic_saturation"])
def test_some_trials_have_the_other_form_and_their_label_says_so(effect):
    having = [trial.other_forms for trial in drawn(effect)]
    assert set(having) == {(), (effect,)}
    assert 0.4 < np.mean([bool(forms) for forms in having]) < 0.6
    label = truth_label(
        next(trial for trial in drawn(effect) if trial.other_forms),
        2.0, {}, seed=0,
    )  # fmt: skip
    assert label["other_forms"] == [effect]


def test_units_scatter_within_what_is_said():
    centre = Parameters.calibrated()
    units = [draw_unit(np.random.default_rng(seed)) for seed in range(200)]
    for symbols, most in (
        (CALIBRATED_SYMBOLS, CALIBRATED_SPREAD),
        (PARAMETER_COMPONENTS, UNIT_SCATTER_LIMIT * UNIT_SCATTER),
    ):
        off = np.array([[unit[s] / centre[s] - 1 for s in symbols] for unit in units])
        assert np.max(np.abs(off)) <= most * (1 + 1e-12)
        assert np.max(np.abs(np.mean(off, axis=0))) < 0.25 * most
    assert all(unit[s] == centre[s] for s in ("F_PV", "T_env", "kappa") for unit in units)
