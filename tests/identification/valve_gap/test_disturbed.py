"""Valves whose recordings are disturbed as on real benches: noise is no gap and hides no effect."""

import pytest

from epv_env.plant.channels import SENSORS
from identification.gap.diagnosis import rank_hypotheses
from identification.gap.judge.verdict import Ranking
from identification.gap.prepare.prepared_plant import prepared
from identification.recordings.recording import UNITS, Campaign
from identification.valve_gap.valve import Valve
from tests.identification.disturbances import add_ripple, round_pressures
from tests.identification.valve_gap.campaigns import MANY, all_but, campaign

RIPPLE = {name: 2.0 * SENSORS[name].noise for name in ("p1", "p2", "p3")}
"""Twice the sensors' noise."""

NAMES = ("test1", "low_supply", "long_open", "high_voltage", "validation", "steps")
"""Recordings of a campaign: enough blocks to see a ripple, and half as long as the whole suite."""


def rippled(recorded: Campaign) -> Campaign:
    return add_ripple(recorded, sd=RIPPLE, correlation_time=0.02, seed=1)


def ranked(disturbed: Campaign) -> Ranking:
    return rank_hypotheses(Valve(disturbed, without=all_but("eddy_current", *MANY)))


def test_pressures_in_steps_of_50_mbar_show_no_gap():
    found = ranked(round_pressures(campaign(*NAMES), 0.05))
    assert found.no_cause > found.unknown
    assert max(found.inclusion.values()) < 0.05


def test_a_slow_ripple_on_the_pressures_is_no_gap_and_is_filtered():
    found = ranked(rippled(campaign(*NAMES)))
    assert found.no_cause > 0.5
    plant = prepared(found.problem.plant)
    seen = {
        c.name: r.sd * c.known_noise for c, r in zip(plant.channels, plant.ripples, strict=True) if r
    }
    expected = {name: RIPPLE[name] * UNITS[name][1] for name in ("p2", "p3")}
    assert seen == pytest.approx(expected, rel=0.25)


def test_a_true_effect_is_found_under_a_slow_ripple():
    assert ranked(rippled(campaign(*NAMES, G_eddy=4e-3))).inclusion["eddy_current"] > 0.9
