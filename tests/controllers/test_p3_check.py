"""The check finds a p3 that stands still, believes one that moves, and hands the valve over."""

from dataclasses import dataclass

import numpy as np
import pytest

from controllers.hysteresis import Hysteresis
from controllers.pulse import InformedPulse
from controllers.sensor_check import P3Check
from epv_env.observation import LAYOUT, encode

VALVES = 3


@dataclass(kw_only=True)
class Constant:
    """Always the same action."""

    action: int
    name: str = "constant"
    environment: str = "EPValve-v0"
    control_period: float = 5e-3

    def reset(self, n: int) -> None:
        self.n = n

    def act(self, observations):
        return np.full(len(observations), self.action)


def checked(**settings) -> P3Check:
    """A check that has seen p3 move for 25 ms."""
    check = P3Check(main=Constant(action=0), fallback=Constant(action=1), **settings)
    check.reset(VALVES)
    for _ in range(5):
        check.act(seen())
    return check


def seen(**values):
    """An observation of VALVES valves: the coil off for 25 ms, p3 at 6 bar and falling."""
    usual = {"p1": 11.0, "p3": 6.0, "action": 0.0, "since_switching": 0.025, "p3_change_4": -0.8}
    mine = {quantity.name: np.full(VALVES, quantity.centre) for quantity in LAYOUT}
    chosen = {
        name: np.broadcast_to(np.asarray(v, float), VALVES) for name, v in (usual | values).items()
    }
    return encode(mine | chosen)


@pytest.mark.parametrize(
    ("values", "failed"),
    [
        ({}, False),
        ({"p3_change_4": 0.0}, True),
        ({"p3_change_4": 0.015}, True),
        ({"p3_change_4": 0.0, "since_switching": 0.020}, False),  # the armature may not have moved
        ({"p3_change_4": 0.0, "p3": 1.3}, False),  # it has emptied
        ({"p3_change_4": 0.0, "action": 1.0}, True),
        ({"p3_change_4": 0.0, "action": 1.0, "p3": 10.8}, False),  # it has filled
        ({"action": 1.0, "p3_change_4": 0.8}, False),
    ],
)
def test_only_a_reading_that_stands_still_against_the_coil_is_implausible(values, failed):
    check = checked()
    assert np.all(check.act(seen(**values)) == int(failed))
    assert np.all(check.failed == failed)


def test_each_valve_is_judged_alone_and_until_the_reset():
    check = checked()
    check.act(seen(p3_change_4=[-0.8, 0.0, -0.8]))
    assert check.act(seen()).tolist() == [0, 1, 0]
    check.reset(VALVES)
    assert check.act(seen()).tolist() == [0, 0, 0]


def test_the_first_observations_are_believed():
    check = checked()
    check.reset(VALVES)
    actions = [check.act(seen(p3_change_4=0.0))[0] for _ in range(6)]
    assert actions == [0, 0, 0, 0, 1, 1]


def test_a_fallback_for_other_actions_is_refused():
    other = Hysteresis(open_below=-0.1, shut_above=0.0, environment="EPValvePWM-v0")
    with pytest.raises(ValueError, match="must act in the same environment"):
        P3Check(main=Constant(action=0), fallback=other)


def test_a_controller_that_reads_no_sensor_is_refused():
    with pytest.raises(ValueError, match="reads no sensor"):
        P3Check(main=InformedPulse(), fallback=Constant(action=1))
