"""The bench's sensors: Tables 1 to 3 are recovered from its records, and seeds mean what they say."""

import numpy as np
import pytest

from epv_env.plant.channels import SENSORS
from identification.bench.programmes import DIAGNOSIS_SUITE
from identification.bench.session import measured_campaign, measured_recording
from identification.recordings.campaign_files import read_campaign, write_campaign
from identification.recordings.recording import CHANNELS, UNITS
from tests.identification.twins import REPORT, TRUE, truth, twin


def rest(seed=5):
    return measured_recording(truth("rest"), np.random.default_rng(seed))


def line(channel, seed=5):
    """Offset and slope at time 0, and the deviation about the line [A, V, bar] of the rest record."""
    recording, (_, unit) = rest(seed), UNITS[channel]
    reading = (recording.channel(channel) - truth("rest").channels[channel]) / unit
    slope, offset = np.polyfit(recording.time, reading, 1)
    return offset, slope, np.std(reading - offset - slope * recording.time), len(recording)


def deviation(channel):
    """Table 3's noise and the rounding to Table 1's steps."""
    sensor = SENSORS[channel]
    return np.hypot(sensor.noise, sensor.resolution / np.sqrt(12))


@pytest.mark.parametrize("channel", CHANNELS)
def test_the_rest_record_shows_tables_1_to_3(channel):
    """Offset and trend, noise, and readings in whole steps of twelve bits."""
    sensor, unit = SENSORS[channel], UNITS[channel][1]
    offset, slope, noise, samples = line(channel)
    error = deviation(channel) / np.sqrt(samples)
    assert offset == pytest.approx(sensor.offset, abs=4 * 2 * error)
    assert slope == pytest.approx(sensor.trend, abs=4 * np.sqrt(12) * error / 5.0)
    assert noise == pytest.approx(deviation(channel), rel=0.03)
    steps = (rest().channel(channel) / unit - sensor.low) / sensor.resolution
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-6)
    assert np.ptp(steps) >= 3


def test_one_seed_gives_one_campaign_and_another_seed_another():
    truths = [truth(name) for name in REPORT]
    one, same, other = (measured_campaign(truths, TRUE, seed=seed) for seed in (1, 1, 2))
    for a, b, c in zip(one.recordings, same.recordings, other.recordings, strict=True):
        for channel in CHANNELS:
            np.testing.assert_array_equal(a.channel(channel), b.channel(channel))
            assert np.any(a.channel(channel) != c.channel(channel))


def test_a_recording_s_noise_does_not_depend_on_how_many_others_there_are():
    two = measured_campaign([truth(name) for name in REPORT[:2]], TRUE, seed=1)
    for alone, among in zip(two.recordings, twin(1).recordings, strict=False):
        np.testing.assert_array_equal(alone.p2, among.p2)


def test_a_written_campaign_keeps_every_rule_and_comes_back(tmp_path):
    names = [programme.name for programme in DIAGNOSIS_SUITE]
    campaign = measured_campaign([truth(name) for name in names], TRUE, seed=3)
    write_campaign(campaign, tmp_path)
    reads = read_campaign(tmp_path)
    assert [(r.name, r.role) for r in reads.recordings] == [
        (r.name, r.role) for r in campaign.recordings
    ]
    assert (reads.temperature, reads.pressure) == (TRUE["T_env"], TRUE["p_env"])
    for read, written in zip(reads.recordings, campaign.recordings, strict=True):
        np.testing.assert_allclose(read.p2, written.p2, atol=0.51)
        np.testing.assert_allclose(read.I, written.I, atol=0.51e-6)
