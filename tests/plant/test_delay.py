"""The delay of the voltage: inputs in parts, recordings and periods of control agree."""

import numpy as np
import pytest

from epv_env.plant.equations import Inputs, State
from epv_env.plant.lanes import N_INPUT
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import PARTS, U_ROW, Valves, delayed_inputs

CALIBRATED = Parameters.calibrated()
PULSE = np.repeat([24.0, 0.0, 24.0], [4, 20, 12])
"""An opening of 100 ms in periods of 5 ms."""


EACH_PERIOD = 40
"""Instants in a period at which the voltage is looked at."""


def acting(U, period: float, delays: tuple[float, float], time):
    """The delayed voltage of one lane at `time`, read off the parts."""
    table = np.zeros((len(U), N_INPUT, 1))
    table[:, U_ROW, 0] = U
    parts, duration = delayed_inputs(table, np.full((len(U), 1), period), np.array(delays)[:, None])
    ends = np.cumsum(duration[:, 0])
    np.testing.assert_allclose(ends[PARTS - 1 :: PARTS], period * np.arange(1, len(U) + 1), rtol=1e-12)
    return parts[np.searchsorted(ends, time, side="right"), U_ROW, 0]


def instants(U, period: float):
    """Times between those at which anything changes."""
    return (np.arange(len(U) * EACH_PERIOD) + 0.5) * period / EACH_PERIOD


@pytest.mark.parametrize("periods", [0.0, 1.0, 1.7])
def test_a_pulse_acts_later_by_the_delay(periods):
    period = 5e-3
    time = instants(PULSE, period)
    found = acting(PULSE, period, (periods * period, periods * period), time)
    sent = np.floor((time / period) - periods + 1e-9).astype(int)
    np.testing.assert_array_equal(found, PULSE[np.maximum(sent, 0)])


@pytest.mark.parametrize(("on", "off"), [(0.0, 1.7), (2.4, 0.0), (0.3, 0.8), (3.0, 1.0)])
def test_each_edge_has_its_own_delay(on, off):
    time = instants(PULSE, 1.0)
    expected = np.where((time >= 4.0 + off) & (time < 24.0 + on), 0.0, 24.0)
    np.testing.assert_array_equal(acting(PULSE, 1.0, (on, off), time), expected)


@pytest.mark.parametrize(("on", "off"), [(0.0, 2.5), (2.5, 0.0), (1.0, 3.5), (0.4, 0.9)])
def test_a_voltage_that_a_later_one_overtakes_never_acts(on, off):
    """The coil follows the latest voltage that has arrived: gaps and pulses vanish, or merge."""
    rng = np.random.default_rng(3)
    U = np.concatenate(
        [np.repeat([24.0, 0.0, 24.0], 4), np.repeat(rng.permutation([24.0, 0.0] * 40), 2)]
    )
    time, number = instants(U, 1.0), np.arange(len(U))
    arrival = number + np.where(U > 0.0, on, off)
    arrival[0] = 0.0
    latest = np.max(np.where(arrival <= time[:, None], number, 0), axis=1)
    np.testing.assert_array_equal(acting(U, 1.0, (on, off), time), U[latest])


@pytest.mark.parametrize(("w_delay", "U_on", "U_short"), [(1.0, 24.0, 0.0), (-1.0, 0.0, 24.0)])
def test_a_pulse_shorter_than_the_difference_of_the_delays_is_none(w_delay, U_on, U_short):
    """Its rise is delayed past its fall; one sample longer, and a pulse of one sample is left."""
    period = 5e-4
    for samples, left in ((8, 0), (9, 1)):
        U, expected = np.full(60, U_on), np.full(60, U_on)
        U[20 : 20 + samples] = U_short
        expected[28 : 28 + left] = U_short
        found = recorded(valve(4 * period, w_delay), U, period)
        np.testing.assert_array_equal(found.I, recorded(valve(0.0), expected, period).I)


def test_switching_off_alone_is_late_at_the_upper_end_of_the_share():
    later = recorded(valve(1e-3, 1.0), PULSE, 5e-3)
    U = np.repeat(PULSE, 5)
    U[20:22] = 24.0  # twice the delay, in samples of 1 ms
    finer = recorded(valve(0.0), U, 1e-3)
    for name in ("p2", "p3", "I"):
        true = getattr(finer, name)[4::5]
        np.testing.assert_allclose(getattr(later, name), true, rtol=1e-4, atol=1e-5, err_msg=name)
    assert np.max(later.xPV) > 1e-3


def valve(t_delay: float, w_delay: float = 0.0) -> Valves:
    start = energised(CALIBRATED, p1=12e5, p2=6.8e5, U=24.0)
    return Valves.started(1, {**CALIBRATED, "t_delay": t_delay, "w_delay": w_delay}, start)


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


@pytest.mark.parametrize(
    ("delay", "share"), [(2e-3, 0.0), (5e-3, 0.0), (7e-3, 0.0), (4e-3, 0.7), (4e-3, -1.0)]
)
def test_periods_of_control_agree_with_the_recording(delay, share):
    at_once = recorded(valve(delay, share), PULSE, 5e-3)
    valves = valve(delay, share)
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
