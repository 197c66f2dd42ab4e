"""Actions are on-times of the coil: whole periods, or duty realised in steps of half a millisecond."""

import numpy as np
import pytest

from epv_env.actions import PWM
from tests.env.rollouts import native, run

QUIET = {"scenario": "none", "supply": 9.0, "target_bar": 7.0, "p2_bar": 7.0}


def duties(*values):
    """PWM actions for duties, one environment."""
    return (2 * np.array(values, np.float32) - 1)[:, None, None]


def state(env):
    """All states of the plant, (fields, n)."""
    return np.array(env.task.valves.state)


def test_duty_is_realised_in_half_milliseconds():
    asked = np.random.default_rng(0).uniform(-1, 1, (1000, 1)).astype(np.float32)
    on_time, duty = PWM(20e-3).decode(asked)
    slots = on_time / 0.5e-3
    np.testing.assert_allclose(slots, np.rint(slots), atol=1e-9)
    assert np.all(np.abs(on_time - (asked[:, 0] + 1) / 2 * 20e-3) <= 0.25e-3 + 1e-9)
    np.testing.assert_allclose(duty * 20e-3, on_time)
    assert len(np.unique(np.rint(slots))) == 41


@pytest.mark.parametrize("on", [0, 1])
def test_full_and_empty_duty_equal_on_and_off(on):
    options = {"control_period": 20e-3, "scenario": "steps"}
    found = run(native("EPValvePWM-v0", 3, **options), duties(*[on] * 60).repeat(3, axis=1))
    expected = run(native("EPValve-v0", 3, **options), np.full((60, 3), on))
    for a, b in zip(found.steps, expected.steps, strict=True):
        np.testing.assert_array_equal(a.observation, b.observation)
        np.testing.assert_array_equal(a.reward, b.reward)


def test_half_duty_equals_on_and_off_at_twice_the_rate():
    """Same mean voltage, same instants: the same plant to the bit."""
    pwm = native("EPValvePWM-v0", 1, **QUIET)
    on_off = native("EPValve-v0", 1, control_period=10e-3, **QUIET)
    pwm.reset(seed=0)
    on_off.reset(seed=0)
    for _ in range(20):
        pwm.step(np.zeros((1, 1), np.float32))
        on_off.step(np.array([1]))
        on_off.step(np.array([0]))
        np.testing.assert_array_equal(state(pwm), state(on_off))


@pytest.mark.parametrize(
    ("identifier", "commands", "counted"),
    [
        ("EPValve-v0", np.array([1, 1, 0, 0, 1, 0])[:, None], [0, 0, 1, 0, 1, 1]),
        ("EPValvePWM-v0", duties(1, 0.5, 0.5, 0.5, 0, 0, 1, 1, 0.5, 0), [0, 1, 2, 2, 0, 0, 1, 0, 1, 0]),
    ],
)
def test_switchings_are_counted_from_a_coil_that_is_on(identifier, commands, counted):
    found = run(native(identifier, 1, **QUIET), commands)
    assert [int(step.infos["switchings"][0]) for step in found.steps] == counted
