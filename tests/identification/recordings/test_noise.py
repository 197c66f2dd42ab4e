"""The noise is read off the hold before a test, whatever the plant does afterwards."""

from dataclasses import replace

import numpy as np
import pytest

from epv_env.plant.channels import SENSORS
from identification.recordings.noise import (
    energised_start_length,
    pooled_noise,
)
from identification.recordings.recording import CHANNELS, UNITS, Campaign, CampaignError, Recording

HELD = {"I": 0.57, "U": 24.0, "p1": 12.0, "p2": 7.5, "p3": 12.0}
PERIOD = 1 / 2000


def expected(name):
    """Table 3's noise and the rounding to Table 1's twelve bits [A, V, Pa]."""
    sensor = SENSORS[name]
    return np.sqrt(sensor.noise**2 + sensor.resolution**2 / 12) * UNITS[name][1]


def recording(seed, held, drift=0.0, role="calibration", noisy=1.0):
    """Energised for some samples, then off for as many, with other pressures and currents."""
    rng = np.random.default_rng(seed)
    after = np.arange(2 * held) >= held
    signals = {}
    for name in CHANNELS:
        value = HELD.get(name, HELD["p2"])
        true = np.where(after, 0.1 * value, value) + drift * np.arange(2 * held) * PERIOD
        signals[name] = SENSORS[name].measure(true, noisy * rng.standard_normal(2 * held))
        signals[name] *= UNITS[name][1]
    return Recording(name=f"test{seed}", role=role, period=PERIOD, sigma_S=np.zeros(2 * held), **signals)


def campaign(*recordings):
    return Campaign(name="bench", temperature=293.0, pressure=1e5, recordings=recordings)


@pytest.mark.parametrize("drift", [0.0, 0.05])
def test_the_noise_of_a_long_hold_is_table_3_s(drift):
    """A drift of 50 mbar/s, 50 mA/s and 50 mV/s does not count as noise."""
    noise = pooled_noise(campaign(recording(0, 4000, drift)))
    for name in CHANNELS:
        assert noise[name] == pytest.approx(expected(name), rel=0.05)


def test_a_hold_of_40_ms_is_enough_and_less_is_refused():
    assert energised_start_length(recording(0, 80)) == 80
    assert pooled_noise(campaign(recording(0, 80)))["p2"] == pytest.approx(expected("p2"), rel=0.3)
    with pytest.raises(CampaignError, match=r"test0: energised for the first 39\.5 ms only"):
        pooled_noise(campaign(recording(0, 79)))


def test_noise_finer_than_a_step_counts_as_a_rounding_error():
    noise = pooled_noise(campaign(recording(0, 200, noisy=0.0)))
    assert noise["U"] == pytest.approx(SENSORS["U"].resolution / np.sqrt(12))


def test_many_short_holds_are_pooled():
    pooled = pooled_noise(campaign(*(recording(seed, 100) for seed in range(20))))
    for name in CHANNELS:
        assert pooled[name] == pytest.approx(expected(name), rel=0.08)


def test_the_steady_record_is_preferred():
    """All of it, though its coil is off."""
    steady = recording(0, 1000, role="quality")
    steady = replace(steady, U=np.zeros(2000))
    pooled = pooled_noise(campaign(steady, recording(1, 100, noisy=3.0)))
    alone = pooled_noise(campaign(steady))
    assert pooled == alone
