"""A lost reading is held for HELD periods; then the fall-back decides, without p2 the coil stays on."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from controllers.held_readings import HELD, HeldReadings
from controllers.p3_check import P3Check
from controllers.tuned import tuned
from epv_env.observation import LAYOUT, decode, encode
from epv_env.plant.channels import SENSORS
from tests.controllers.test_p3_check import Constant

LOST = [np.nan, np.inf, -np.inf, 0.0, 0.7, 16.3, 1e308]
CHANNELS = ["p1", "p2", "p3", "I", "target"]


@dataclass(kw_only=True)
class Recorder(Constant):
    """The same, and what it was shown."""

    action: int = 0
    shown: list = field(default_factory=list)

    def act(self, observations):
        self.shown.append(observations)
        return super().act(observations)


def seen(*, p1=11.0, p2=8.0, p3=6.0, I=0.0, target=8.0, fall=0.5):  # noqa: E741
    """The coil off, p3 at `fall` bar a period."""
    usual = {"p1": p1, "p2_error": p2 - target, "p3": p3, "I": I, "target": target, "action": 0.0}
    usual |= {"since_switching": 0.02, "p3_change_1": -fall, "p3_change_4": -4 * fall}
    mine = {quantity.name: quantity.centre for quantity in LAYOUT} | usual
    return encode({name: np.array([value]) for name, value in mine.items()})


def checked(fallback: int = 0) -> tuple[P3Check, Recorder]:
    """A check that has seen good readings, and the controller that it is worn around."""
    main = Recorder()
    check = P3Check(main=main, fallback=Constant(action=fallback))
    check.reset(1)
    for _ in range(3):
        check.act(seen())
    return check, main


def test_good_readings_are_passed_as_they_are() -> None:
    readings, good = HeldReadings(SENSORS), seen()
    readings.reset(1)
    assert all(readings.hold(good) is good for _ in range(3))
    for channel, bounds in {
        "p1": P,
        "p2": P,
        "p3": P,
        "target": P,
        "I": SENSORS["I"].constants()[3:],
    }.items():
        for end in bounds:  # a saturated reading is a reading
            at_the_end = seen(**{channel: end})
            assert readings.hold(at_the_end) is at_the_end


P = SENSORS["p1"].constants()[3:]
"""Ends of a pressure sensor [bar]."""


@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize("value", LOST)
def test_a_lost_reading_is_held_and_then_the_fall_back_decides(channel, value) -> None:
    if channel == "I" and 0.0 <= value <= 1.0:
        pytest.skip("a good current")
    check, main = checked(fallback=1)
    with np.errstate(all="ignore"):
        lost = seen(**{channel: value})
    assert [check.act(lost)[0] for _ in range(HELD)] == [0] * HELD
    for name in ("p1", "p3", "I", "target", "p2_error"):
        assert decode(main.shown[-1], name) == pytest.approx(decode(seen(), name), abs=1e-6)
    assert np.all(np.isfinite(main.shown[-1]))
    assert check.act(lost)[0] == 1
    assert check.act(seen())[0] == 1  # until the reset
    assert check.failed
    check.reset(1)
    assert check.act(seen())[0] == 0


def test_a_short_loss_ends_without_a_trace() -> None:
    """The change over past periods is made of what was held, until it reaches back beyond the loss."""
    check, main = checked()
    check.act(seen(p3=0.0, fall=6.0))
    check.act(seen(p3=5.0, fall=-5.0))
    assert decode(main.shown[-1], "p3_change_1") == pytest.approx(-1.0, abs=1e-5)
    good = seen(p3=5.0)
    for _ in range(8):
        check.act(good)
    assert main.shown[-1] is good
    assert not check.failed


@pytest.mark.parametrize(
    ("channel", "decided"), [("p1", 0), ("p3", 0), ("I", 0), ("p2", 1), ("target", 1)]
)
def test_without_p2_or_a_target_the_coil_stays_on(channel, decided) -> None:
    check, _ = checked()
    actions = [check.act(seen(**{channel: np.nan}))[0] for _ in range(HELD + 100)]
    assert actions == [0] * HELD + [decided] * 100
    assert check.act(seen())[0] == 0


@pytest.mark.parametrize(("channel", "decided"), [("p3", 0), ("p2", 1)])
def test_what_never_was_is_not_held(channel, decided) -> None:
    """Lost from the start: the coil stays on until the fall-back decides."""
    check, _ = checked()
    check.reset(1)
    actions = [check.act(seen(**{channel: 0.0}))[0] for _ in range(HELD + 2)]
    assert actions == [1] * HELD + [decided] * 2


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf, 1e308])
def test_the_learner_without_a_check_keeps_numbers(value) -> None:
    controller: Any = tuned("adaptive pulse")
    controller.reset(1)
    for k in range(60):
        with np.errstate(all="ignore"):
            lost = seen(p1=value, p2=value, p3=value)
        assert controller.act(lost if k in (20, 21) else seen(p3=6.0 - 0.05 * k))[0] in (0, 1)
    numbers = controller.learner.valves.view(np.float64)
    assert np.all(np.isfinite(numbers))
