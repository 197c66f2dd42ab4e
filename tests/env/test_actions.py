"""Actions are on-times of the coil: whole periods, or duty realised in steps of half a millisecond."""

import numpy as np
import pytest

from epv_env.actions import PWM
from tests.env.rollouts import native, run

QUIET = {"scenario": "none", "supply": 9.0, "target_bar": 7.0, "p2_bar": 7.0}


def duties(*values):
    """PWM actions for duties, one environment."""
    return (2 * np.array(values, np.float32) - 1)[:, None, None]


def switchings(identifier, commands):
    """Switchings counted in each period of one environment."""
    found = run(native(identifier, 1, **QUIET), commands)
    return [int(step.infos["switchings"][0]) for step in found.steps]


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


def test_duty_s_ends_are_exactly_off_and_on():
    on_time, duty = PWM(20e-3).decode(np.array([[-1], [1], [-7], [7]]))
    np.testing.assert_array_equal(on_time, [0, 20e-3, 0, 20e-3])
    np.testing.assert_array_equal(duty, [0, 1, 0, 1])


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


def test_switchings_of_on_off_are_changes_of_the_action():
    """An episode begins with the coil on."""
    commands = np.array([1, 1, 0, 0, 1, 0])[:, None]
    assert switchings("EPValve-v0", commands) == [0, 0, 1, 0, 1, 1]


def test_a_pulse_in_every_period_switches_twice_and_staying_not_at_all():
    commands = duties(1, 0.5, 0.5, 0.5, 0, 0, 1, 1, 0.5, 0)
    assert switchings("EPValvePWM-v0", commands) == [0, 1, 2, 2, 0, 0, 1, 0, 1, 0]
