"""The switching life counts cycles."""

import math

import pytest

from training.evaluation.switching_life import Duty, life_years

pytestmark = pytest.mark.training


def test_two_switchings_a_second_all_the_time_use_a_cycle_a_second():
    duty = Duty(hours_per_year=1000, braking=1.0, rated_cycles=7.2e6)
    assert life_years(at_rest=50.0, in_service=2.0, duty=duty) == pytest.approx(2.0)


def test_rest_and_service_count_by_their_share_of_the_time():
    duty = Duty(braking=0.25)
    mixed = life_years(at_rest=4.0, in_service=8.0, duty=duty)
    assert mixed == pytest.approx(life_years(at_rest=5.0, in_service=5.0, duty=duty))


def test_a_valve_that_never_switches_lasts_for_ever():
    assert life_years(at_rest=0.0, in_service=0.0) == math.inf
