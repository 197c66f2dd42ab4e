"""Sensors have the range of Table 1, the converter's 12 bits and the noise of Table 3."""

import numpy as np
import pytest

from epv_env.plant.channels import SENSORS

TABLE_3 = {"p1": 0.0068, "p2": 0.0098, "p3": 0.0075, "I": 0.0008, "U": 0.0122}

each = pytest.mark.parametrize("name", SENSORS)


def inside(sensor, n=10_001):
    """True values over the sensor's range."""
    return np.linspace(sensor.low, sensor.high, n)


@each
def test_twelve_bits_resolve_the_range(name):
    sensor = SENSORS[name]
    readings = np.unique(sensor.measure(inside(sensor, 400_001), np.zeros(400_001)))
    np.testing.assert_allclose(np.diff(readings), (sensor.high - sensor.low) / 4096, rtol=1e-6)
    assert len(readings) in (4096, 4097)


def test_a_pressure_step_is_3_66_millibar():
    assert SENSORS["p2"].resolution == 15 / 4096


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


@each
def test_noise_moves_a_reading_in_its_direction(name):
    sensor = SENSORS[name]
    values = np.full(3, 0.5 * (sensor.low + sensor.high))
    low, middle, high = sensor.measure(values, np.array([-10.0, 0.0, 10.0]))
    assert low < middle < high
    assert high - low == pytest.approx(20 * sensor.noise, abs=sensor.resolution)


def test_shape_and_input_are_kept():
    values = np.full((3, 4), 8.0)
    assert SENSORS["p2"].measure(values, np.zeros((3, 4))).shape == (3, 4)
    np.testing.assert_array_equal(values, 8.0)
