"""Impossible readings are lost, a frozen p3 is found; the fall-back decides; without p2 it stays on."""

from typing import Any

import numpy as np
import pytest

from controllers.hysteresis import Hysteresis
from controllers.sensor_check import HELD, SENSES, checked, ends_of, overruled
from controllers.tuned import tuned
from epv_env.observation import LAYOUT, READINGS, decode, encode, read
from epv_env.plant.channels import SENSORS
from epv_env.plant.plantfile import Plant

PERIOD = 5e-3
ENDS = ends_of(Plant.calibrated().sensors)
USUAL = Hysteresis(open_below=-0.1, shut_above=0.0).constants
NEVER, ALWAYS = (USUAL._replace(open_below=end, shut_above=end) for end in (-np.inf, np.inf))
"""Fall-backs that keep the coil on, and off."""
LOST = [np.nan, np.inf, -np.inf, 0.0, 0.7, 16.3, 1e308]
CHANNELS = ["p1", "p2", "p3", "I", "target"]


class Check:
    """The check of one valve, and a policy that opens it all the time."""

    def __init__(self, fallback=NEVER, periods: int = 5):
        self.senses, self.fallback = np.zeros(1, SENSES)[0], fallback
        for _ in range(periods):
            self.act(seen())

    def act(self, observation) -> float:
        self.shown, readings = observation.copy(), np.zeros(1, READINGS)[0]
        read(readings, self.shown)
        checked(self.senses, readings, self.shown, ENDS, self.fallback, PERIOD)
        return overruled(self.senses, 0.0)


def seen(*, p1=11.0, p2=8.0, p3=6.0, I=0.0, target=8.0, fall=0.2, **others):  # noqa: E741
    """The coil off for 20 ms, p3 falling by `fall` bar a period."""
    usual = {"p1": p1, "p2_error": p2 - target, "p3": p3, "I": I, "target": target, "action": 0.0}
    usual |= {"since_switching": 0.02, "p3_change_1": -fall, "p3_change_4": -4 * fall} | others
    mine = {quantity.name: quantity.centre for quantity in LAYOUT} | usual
    with np.errstate(all="ignore"):
        return encode({name: np.array([value]) for name, value in mine.items()})[0]


def test_good_readings_are_passed_as_they_are() -> None:
    pressures = SENSORS["p1"].constants()[3:]
    bounds = dict.fromkeys(CHANNELS, pressures) | {"I": SENSORS["I"].constants()[3:]}
    for channel, ends in bounds.items():
        for end in ends:  # a saturated reading is a reading
            check, at_the_end = Check(periods=0), seen(**{channel: end})
            check.act(at_the_end)
            np.testing.assert_array_equal(check.shown, at_the_end)


@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize("value", LOST)
def test_while_a_reading_is_lost_the_fall_back_decides_and_after_three_until_the_reset(channel, value):
    if channel == "I" and 0.0 <= value <= 1.0:
        pytest.skip("a good current")
    check, lost = Check(), seen(**{channel: value})
    assert [check.act(lost) for _ in range(HELD)] == [1] * HELD
    for name in ("p1", "p3", "I", "target", "p2_error"):
        assert decode(check.shown, name) == pytest.approx(decode(seen(), name), abs=1e-6)
    assert np.all(np.isfinite(check.shown))
    assert check.act(seen()) == 0
    assert check.act(lost) == 1  # a good reading makes up for an eighth of a lost one
    assert check.act(seen()) == 1  # until the reset
    assert Check().act(seen()) == 0


@pytest.mark.parametrize(
    ("values", "lost"),
    [
        ({"p1": 11.4}, False),
        ({"p1": 11.6}, True),  # a reservoir does not jump
        ({"p3": 11.4, "p1": 11.4}, True),  # nor does a chamber
        ({"p3": 7.2}, False),  # the armature may not have moved
        ({"p3": 6.4, "since_switching": 0.025}, True),  # it empties
        ({"p3": 5.2, "since_switching": 0.025}, False),
        ({"p3": 5.6, "since_switching": 0.025, "action": 1.0}, True),  # it fills
        ({"p3": 6.8, "since_switching": 0.025, "action": 1.0}, False),
        ({"I": 0.9}, False),
    ],
)
def test_readings_that_a_valve_cannot_show_are_lost(values, lost):
    check = Check()
    assert check.act(seen(**values)) == int(lost)
    assert check.senses["lost"] == lost


def test_p3_never_lies_above_p1():
    for p3, lost in ((7.0, 0), (7.2, 1)):
        check = Check(periods=0)
        check.act(seen(p1=7.0))
        assert check.act(seen(p1=6.7, p3=p3)) == lost


def test_a_short_loss_ends_without_a_trace() -> None:
    """The change over past periods is made of what was held, until it reaches back beyond the loss."""
    check = Check()
    check.act(seen(p3=0.0, fall=6.0))
    check.act(seen(p3=5.0, fall=-5.0))
    assert decode(check.shown, "p3_change_1") == pytest.approx(-1.0, abs=1e-5)
    for _ in range(8):
        check.act(seen(p3=5.0))
    np.testing.assert_array_equal(check.shown, seen(p3=5.0))
    assert check.act(seen()) == 0


@pytest.mark.parametrize(
    ("channel", "decided"), [("p1", 0), ("p3", 0), ("I", 0), ("p2", 1), ("target", 1)]
)
def test_without_p2_or_a_target_the_coil_stays_on(channel, decided) -> None:
    check = Check(ALWAYS)
    actions = [check.act(seen(**{channel: np.nan})) for _ in range(HELD + 100)]
    assert actions == [0] * HELD + [decided] * 100
    assert check.act(seen()) == 0
    fresh = Check(ALWAYS, periods=0)  # what never was is not held: the coil stays on meanwhile
    actions = [fresh.act(seen(**{channel: np.nan})) for _ in range(HELD + 2)]
    assert actions == [1] * HELD + [decided] * 2


@pytest.mark.parametrize(
    ("values", "failed"),
    [
        ({}, False),
        ({"p3_change_4": 0.0}, True),
        ({"p3_change_1": 0.0}, True),
        ({"p3_change_1": 0.0, "p3": 3.9}, False),  # near the end a period's change is like the noise
        ({"p3_change_4": 0.015}, True),
        ({"p3_change_4": 0.0, "since_switching": 0.020}, False),  # the armature may not have moved
        ({"p3_change_4": 0.0, "p3": 1.3}, False),  # it has emptied
        ({"p3_change_4": 0.0, "action": 1.0}, True),
        ({"p3_change_4": 0.0, "action": 1.0, "p3": 10.8}, False),  # it has filled
        ({"action": 1.0, "p3_change_4": 0.8}, False),
    ],
)
def test_only_a_reading_that_stands_still_against_the_coil_is_implausible(values, failed):
    check, usual = Check(periods=0), {name: values[name] for name in {*values} & {"p3", "action"}}
    for _ in range(6):
        check.act(seen(**usual))
    assert check.act(seen(**({"since_switching": 0.025} | values))) == int(failed)
    assert check.act(seen(**usual)) == int(failed)  # until the reset


def test_the_first_observations_are_believed():
    check = Check(periods=0)
    actions = [check.act(seen(p3_change_4=0.0, since_switching=0.025)) for _ in range(6)]
    assert actions == [0] * 4 + [1] * 2


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf, 1e308])
def test_the_learner_without_a_check_keeps_numbers(value) -> None:
    controller: Any = tuned("adaptive pulse")
    controller.reset(1)
    lost = seen(p1=value, p2=value, p3=value)[None]
    for k in range(60):
        action = controller.act(lost if k in (20, 21) else seen(p3=6.0 - 0.05 * k)[None])
        assert action[0] in (0, 1)
    assert np.all(np.isfinite(controller.memory.view(np.float64)))
