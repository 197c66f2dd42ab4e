"""Measured channels: one record each, sensors of Tables 1 and 3, and what effects make of readings."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from epv_env.plant.channels import (
    CURRENT,
    MEASURED,
    P2,
    SENSOR_SYMBOLS,
    SENSORS,
    VOLTAGE,
    ChannelError,
    readings,
)
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import Trajectory, energised, simulate
from epv_env.plant.valves import Valves
from identification.recordings.recording import CHANNELS, OUTPUTS


def test_the_order_of_channels_is_that_of_files_and_of_drawn_noise():
    """A further channel comes after these."""
    assert MEASURED[:4] == ("p1", "p2", "p3", "I")
    assert SENSOR_SYMBOLS[:6] == ("g_p1", "b_p2", "g_p2", "b_p3", "g_p3", "g_I")
    assert OUTPUTS[:3] == ("p2", "p3", "I")
    assert CHANNELS[:5] == ("I", "U", "p1", "p2", "p3")
    assert list(SENSORS)[:5] == ["p1", "p2", "p3", "I", "U"]


@pytest.mark.parametrize(
    ("channel", "changes", "message"),
    [
        (P2, {"unit": ""}, "measured channel 'p2': unit is empty: fill it in"),
        (P2, {"columns": ()}, "columns is empty"),
        (P2, {"scale": 0.0}, "scale is 0: give the size of one bar in SI units"),
        (CURRENT, {"reading": None}, "an output or observed channel needs `reading`"),
        (VOLTAGE, {"output": True}, "'U': an output or observed channel needs `reading`"),
    ],
)
def test_an_incomplete_record_is_refused_in_one_sentence(channel, changes, message):
    with pytest.raises(ChannelError, match=message):
        replace(channel, **changes)


TABLE_3 = {"p1": 0.0068, "p2": 0.0098, "p3": 0.0075, "I": 0.0008, "U": 0.0122}

each = pytest.mark.parametrize("name", ["p2", "I", "U"])


def inside(sensor, n=10_001):
    """True values over the sensor's range."""
    return np.linspace(sensor.low, sensor.high, n)


@each
def test_a_reading_without_noise_is_the_nearest_step(name):
    sensor = SENSORS[name]
    error = sensor.measure(inside(sensor), np.zeros(10_001)) - inside(sensor)
    assert np.max(np.abs(error)) <= sensor.resolution / 2 * (1 + 1e-9)
    assert abs(np.mean(error)) < 0.01 * sensor.resolution


@each
def test_readings_saturate_at_the_range_and_its_accuracy(name):
    sensor = SENSORS[name]
    far = sensor.measure(np.array([-1e6, 1e6]), np.zeros(2))
    margin = sensor.accuracy * sensor.high
    np.testing.assert_array_equal(far, [sensor.low - margin, sensor.high + margin])


@each
def test_noise_has_the_standard_deviation_of_table_3(name):
    """Rounding adds its own twelfth of a step squared, as long as the noise spans a step."""
    sensor = SENSORS[name]
    assert sensor.noise == TABLE_3[name]
    rng = np.random.default_rng(0)
    middle = 0.3 * sensor.low + 0.7 * sensor.high
    found = sensor.measure(
        middle + sensor.resolution * rng.random(100_000), rng.standard_normal(100_000)
    )
    expected = np.sqrt(sensor.noise**2 + sensor.resolution**2 / 6)  # of the dither and of rounding
    assert np.std(found) == pytest.approx(expected, rel=0.01)


CALIBRATED = Parameters.calibrated()
TRUE = {"p1": "p1", "p2": "p2", "p3": "p3", "I": "I_coil"}


def opening(p: Parameters) -> Trajectory:
    U = np.full(3000, 24.0)
    U[200:1200] = 0.0
    return simulate(p, initial=energised(p, p1=12e5, p2=6.8e5, U=24.0), U=U, period=1e-4)


def test_sensors_without_effects_read_the_state():
    run = opening(CALIBRATED)
    values = readings(run.state, CALIBRATED)
    assert set(MEASURED) <= set(values)
    for name, field in TRUE.items():
        np.testing.assert_array_equal(values[name], getattr(run.state, field), err_msg=name)


def test_gains_multiply_readings_and_biases_are_added_exactly():
    sizes = {"g_p1": 0.01, "g_p2": -0.02, "b_p2": 2e4, "g_p3": 0.03, "b_p3": -3e4, "g_I": 0.05}
    p = CALIBRATED.replace(**sizes)
    run, nominal = opening(p), opening(CALIBRATED)
    values = readings(run.state, p)
    for name, field in TRUE.items():
        true = getattr(nominal.state, field)
        np.testing.assert_array_equal(getattr(run.state, field), true)
        wrong = true * (1.0 + sizes[f"g_{name}"]) + sizes.get(f"b_{name}", 0.0)
        np.testing.assert_array_equal(values[name], wrong, err_msg=name)


def test_every_valve_of_a_batch_has_sensors_of_its_own():
    sizes = {"b_p2": [0.0, 2e4], "b_p3": [-3e4, 0.0], "g_I": [0.05, 0.0]}
    p = {**CALIBRATED, **{symbol: np.array(values) for symbol, values in sizes.items()}}
    valves = Valves.started(2, p, energised(CALIBRATED, p1=12e5, p2=6e5, U=24.0))
    current = np.array([1.05, 1.0]) * 24.0 / CALIBRATED["R"]
    expected = {"p1": [12e5] * 2, "p2": [6e5, 6.2e5], "p3": [11.7e5, 12e5], "I": current}
    found = readings(valves.state, valves.tables.sensors[:2])
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-12, err_msg=name)


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
