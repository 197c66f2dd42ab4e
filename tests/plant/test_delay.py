"""The delay of the voltage: inputs in parts, recordings and periods of control agree."""

import numpy as np
import pytest

from epv_env.plant.equations import Inputs, State
from epv_env.plant.lanes import N_INPUT
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import U_ROW, Valves, delayed_inputs

CALIBRATED = Parameters.calibrated()
PULSE = np.repeat([24.0, 0.0, 24.0], [4, 20, 12])
"""An opening of 100 ms in periods of 5 ms."""


def acting(U, period: float, delay: float, time):
    """The delayed voltage of one lane at `time`, read off the parts."""
    table = np.zeros((len(U), N_INPUT, 1))
    table[:, U_ROW, 0] = U
    parts, duration = delayed_inputs(table, np.full((len(U), 1), period), np.array([delay]))
    ends = np.cumsum(duration[:, 0])
    np.testing.assert_allclose(ends[1::2], period * np.arange(1, len(U) + 1), rtol=1e-12)
    return parts[np.searchsorted(ends, time, side="right"), U_ROW, 0]


@pytest.mark.parametrize("periods", [0.0, 1.0, 1.7])
def test_a_pulse_acts_later_by_the_delay(periods):
    period = 5e-3
    time = (np.arange(36 * 40) + 0.5) * period / 40  # between the instants at which anything changes
    found = acting(PULSE, period, periods * period, time)
    sent = np.floor((time / period) - periods + 1e-9).astype(int)
    np.testing.assert_array_equal(found, PULSE[np.maximum(sent, 0)])


def valve(t_delay: float) -> Valves:
    start = energised(CALIBRATED, p1=12e5, p2=6.8e5, U=24.0)
    return Valves.started(1, {**CALIBRATED, "t_delay": t_delay}, start)


def recorded(valves: Valves, U, period: float) -> State:
    U = np.asarray(U)
    return valves.record(Inputs(U[:, None], *np.zeros((3, len(U), 1))), period)


def test_a_recording_with_a_delay_is_that_of_the_shifted_voltage():
    """To the bit: a delay of whole samples leaves nothing to part."""
    U, period, samples = np.repeat(PULSE, 10), 5e-4, 4
    shifted = np.concatenate([np.full(samples, U[0]), U[:-samples]])
    later = recorded(valve(samples * period), U, period)
    expected = recorded(valve(0.0), shifted, period)
    for name, found, true in zip(State._fields, later, expected, strict=True):
        np.testing.assert_array_equal(found, true, err_msg=name)
    assert np.max(later.xPV) > 1e-3
    assert np.max(np.abs(later.p3 - recorded(valve(0.0), U, period).p3)) > 5e3


def test_a_delay_within_a_period_is_that_of_finer_samples():
    coarse = recorded(valve(2e-3), PULSE, 5e-3)
    U = np.repeat(PULSE, 5)
    fine = recorded(valve(0.0), np.concatenate([U[:1], U[:1], U[:-2]]), 1e-3)
    for name in ("p2", "p3", "I"):
        true = getattr(fine, name)[4::5]
        np.testing.assert_allclose(getattr(coarse, name), true, rtol=1e-4, atol=1e-5, err_msg=name)
    assert coarse.coil_energy[-1, 0] == pytest.approx(fine.coil_energy[-1, 0], rel=1e-5)


@pytest.mark.parametrize("delay", [2e-3, 5e-3, 7e-3])
def test_periods_of_control_agree_with_the_recording(delay):
    at_once = recorded(valve(delay), PULSE, 5e-3)
    valves = valve(delay)
    for k, U in enumerate(PULSE):
        valves.inputs.U[:] = U
        valves.advance(5e-3)
        for name in ("p2", "p3", "xPV", "I"):
            found, true = getattr(valves.state, name)[0], getattr(at_once, name)[k, 0]
            assert found == pytest.approx(true, rel=1e-4, abs=1e-5), (name, k)
    assert np.max(at_once.xPV) > 1e-3


def test_a_pulse_shorter_than_the_delay_is_lost_when_controlled_in_periods():
    """A change back within the delay takes the change with it; documented at `Valves.advance`."""
    valves = valve(7e-3)
    for U in (24.0, 0.0, 24.0, 24.0, 24.0, 24.0):
        valves.inputs.U[:] = U
        valves.advance(5e-3)
    assert valves.state.I[0] == pytest.approx(24.0 / CALIBRATED["R"], rel=1e-9)
