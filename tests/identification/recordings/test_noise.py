"""The noise of readings about a course that moves, in one recording and in a campaign."""

from dataclasses import replace

import numpy as np
import pytest

from epv_env.plant.channels import SENSORS
from identification.recordings.noise import campaign_noise, noise_of
from identification.recordings.recording import CHANNELS, UNITS, Campaign, Recording
from tests.identification.disturbances import add_ripple


def recording(noise: float, seed: int, steps: float = 0.0) -> Recording:
    """p2 that rises, with steps at the switchings; nothing else of interest."""
    rng = np.random.default_rng(seed)
    time = np.arange(4000) * 5e-4
    U = np.where((time % 0.4) < 0.3, 24.0, 0.0)
    course = 6e5 + 2e5 * time + steps * np.cumsum(np.abs(np.diff(U, prepend=24.0)) > 1)
    p2 = course + noise * rng.standard_normal(len(time))
    return Recording(
        name="x", role="calibration", period=5e-4, I=0 * time, U=U, p1=p2, p2=p2, p3=p2,
        sigma_S=0 * time,
    )  # fmt: skip


@pytest.mark.parametrize("steps", [0.0, 1e4])
def test_noise_is_found_whatever_the_course(steps):
    found = [noise_of([recording(300.0, seed, steps)], "p2") for seed in range(10)]
    assert np.mean(found) == pytest.approx(300.0, rel=0.01)
    assert np.std(found) < 0.03 * 300.0


@pytest.mark.parametrize("noise", [0.0, 300.0])
def test_rounding_is_the_least_noise(noise):
    """Readings in coarse steps hardly differ between neighbours, and err all the same."""
    fine = recording(noise, 0)
    coarse = replace(fine, p2=5e3 * np.rint(fine.p2 / 5e3))
    assert 5e3 / np.sqrt(12) <= noise_of([coarse], "p2") * (1 + 1e-9) < 1.3 * 5e3 / np.sqrt(12)


def test_a_slow_ripple_is_no_noise():
    """20 ms and twice the noise, as a supply's pulsation: the white part alone is found."""
    fine = recording(SENSORS["p2"].noise * 1e5, 0)
    campaign = Campaign(name="x", temperature=293.0, pressure=1e5, recordings=(fine,))
    rippled = add_ripple(campaign, sd={"p2": 2 * SENSORS["p2"].noise}, correlation_time=0.02, seed=0)
    assert noise_of(rippled.recordings, "p2") == pytest.approx(noise_of([fine], "p2"), rel=0.1)


HELD = {"I": 0.57, "U": 24.0, "p1": 12.0, "p2": 7.5, "p3": 12.0}
PERIOD = 1 / 2000


def expected(name):
    """Table 3's noise and the rounding to Table 1's twelve bits [A, V, Pa]."""
    sensor = SENSORS[name]
    return np.sqrt(sensor.noise**2 + sensor.resolution**2 / 12) * UNITS[name][1]


def held_recording(seed, held, drift):
    """Energised for some samples, then off for as many, with other pressures and currents."""
    rng = np.random.default_rng(seed)
    after = np.arange(2 * held) >= held
    signals = {}
    for name in CHANNELS:
        value = HELD.get(name, HELD["p2"])
        true = np.where(after, 0.2 * value, value) + drift * np.arange(2 * held) * PERIOD
        signals[name] = SENSORS[name].measure(true, rng.standard_normal(2 * held))
        signals[name] *= UNITS[name][1]
    return Recording(
        name=f"test{seed}", role="calibration", period=PERIOD, sigma_S=np.zeros(2 * held), **signals
    )


@pytest.mark.parametrize("drift", [0.0, 0.05])
def test_the_noise_of_a_campaign_is_table_3_s(drift):
    """A drift of 50 mbar/s, 50 mA/s and 50 mV/s does not count as noise, nor does the switching."""
    recordings = (held_recording(0, 2000, drift), held_recording(1, 2000, drift))
    campaign = Campaign(name="bench", temperature=293.0, pressure=1e5, recordings=recordings)
    noise = campaign_noise(campaign)
    for name in CHANNELS:
        assert noise[name] == pytest.approx(expected(name), rel=0.05)
