"""What sensors are given to read: lag, bias and gain against their closed forms."""

from itertools import pairwise

import numpy as np
import pytest

from epv_env.plant.channels import MEASURED, readings
from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import Trajectory, energised, simulate
from epv_env.plant.valves import Valves

CALIBRATED = Parameters.calibrated()
TRUE = {"p1": "p1", "p2": "p2", "p3": "p3", "I": "I_coil"}


def opening(p: Parameters) -> Trajectory:
    U = np.full(3000, 24.0)
    U[200:1200] = 0.0
    return simulate(p, initial=energised(p, p1=12e5, p2=6.8e5, U=24.0), U=U, period=1e-4)


def test_sensors_without_effects_read_the_state():
    run = opening(CALIBRATED)
    values = readings(run.state, CALIBRATED)
    assert set(values) == set(MEASURED)
    for name, field in TRUE.items():
        np.testing.assert_array_equal(values[name], getattr(run.state, field), err_msg=name)


@pytest.mark.parametrize(
    ("symbol", "size", "name"), [("b_p2", 2e4, "p2"), ("b_p3", -3e4, "p3"), ("g_I", 0.05, "I")]
)
def test_a_bias_adds_and_a_gain_multiplies_one_reading_exactly(symbol, size, name):
    p = CALIBRATED.replace(**{symbol: size})
    run, nominal = opening(p), opening(CALIBRATED)
    values = readings(run.state, p)
    for other, field in TRUE.items():
        true = getattr(nominal.state, field)
        np.testing.assert_array_equal(getattr(run.state, field), true)
        wrong = true * (1.0 + size) if symbol == "g_I" else true + size
        np.testing.assert_array_equal(values[other], wrong if other == name else true, err_msg=other)


def test_every_valve_of_a_batch_has_sensors_of_its_own():
    valves = Valves(2)
    sizes = {"b_p2": [0.0, 2e4], "b_p3": [-3e4, 0.0], "g_I": [0.05, 0.0]}
    valves.set_parameters(np.arange(2), {**CALIBRATED, **{s: np.array(v) for s, v in sizes.items()}})
    for field, value in zip(valves.state, energised(CALIBRATED, p1=12e5, p2=6e5, U=24.0), strict=True):
        field[:] = value
    current = np.array([1.05, 1.0]) * 24.0 / CALIBRATED["R"]
    expected = {"p1": [12e5] * 2, "p2": [6e5, 6.2e5], "p3": [11.7e5, 12e5], "I": current}
    for name, found in valves.readings().items():
        np.testing.assert_allclose(found, expected[name], rtol=1e-12, err_msg=name)


def test_a_lagging_sensor_stays_behind_a_ramp_by_its_time_constant():
    """Constant consumption, valve shut: p2 falls at RT/V2 sigma; the reading lags by tau times that."""
    p, tau = CALIBRATED.replace(tau_p2=0.02), 0.02
    start = energised(p, p1=12e5, p2=8e5, U=24.0)
    run = simulate(p, initial=start, U=np.full(200, 24.0), period=1e-3, sigma_S=2e-3)
    slope = -p["R_gas"] * p["T_env"] / p["V2"] * 2e-3
    behind = -tau * slope * (1 - np.exp(-run.time / tau))
    reading = readings(run.state, p)["p2"]
    np.testing.assert_allclose(reading - (8e5 + slope * run.time), behind, rtol=1e-6, atol=1e-3)
    assert behind[-1] > 3e3


@pytest.mark.parametrize(("symbol", "name"), [("tau_p2", "p2"), ("tau_p3", "p3")])
def test_a_lagging_sensor_forgets_a_step_exponentially(symbol, name):
    p = CALIBRATED.replace(**{symbol: 0.03})
    behind = {"lag_2" if name == "p2" else "lag_3": -5e4}
    start = energised(p, p1=12e5, p2=6e5, U=24.0)._replace(**behind)
    run = simulate(p, initial=start, U=np.full(100, 24.0), period=1e-3)
    true = getattr(run.state, name)
    np.testing.assert_allclose(
        readings(run.state, p)[name], true - 5e4 * np.exp(-run.time / 0.03), rtol=1e-7
    )


@pytest.mark.parametrize(("symbol", "name"), [("tau_p2", "p2"), ("tau_p3", "p3")])
def test_a_lagging_sensor_is_a_first_order_filter_that_the_valve_does_not_feel(symbol, name):
    """Against the filter's exact response to the pressure, taken linear between samples."""
    tau, period = 0.01, 1e-4
    p = CALIBRATED.replace(**{symbol: tau})
    run, nominal = opening(p), opening(CALIBRATED)
    true = getattr(run.state, name)
    np.testing.assert_allclose(true, getattr(nominal.state, name), rtol=1e-5)
    assert _filtered(true, tau, period) == pytest.approx(readings(run.state, p)[name], abs=100.0)
    assert np.max(np.abs(_filtered(true, 1.05 * tau, period) - readings(run.state, p)[name])) > 500.0


def _filtered(values: np.ndarray, tau: float, period: float) -> np.ndarray:
    left = np.exp(-period / tau)
    out = np.empty_like(values)
    out[0] = values[0]
    for k, (before, after) in enumerate(pairwise(values)):
        slope = (after - before) / period
        out[k + 1] = after - tau * slope + (out[k] - before + tau * slope) * left
    return out


def test_departures_rest_at_zero_without_their_effects():
    run = opening(CALIBRATED.replace(F_PV=1.0))  # in the extended kernel, too
    for field in State._fields[State._fields.index("coil_heat") :]:
        np.testing.assert_array_equal(getattr(run.state, field), 0.0, err_msg=field)
