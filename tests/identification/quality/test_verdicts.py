"""A perfect bench passes every check; each kind of fault fails its own."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from epv_env.plant.channels import SENSORS
from identification.quality.assessment import assess_recording, sensor_offsets, white_noise_band
from identification.quality.section import CHECKS, channel_verdict, check_results, worst_status
from identification.recordings.recording import CHANNELS, UNITS, CampaignError
from tests.identification.quality.printed import STATISTICS, TREND_OFFSETS
from tests.identification.quality.records import (
    AMBIENT,
    PERIOD,
    readings,
    rest_record,
    with_channel,
)

SAMPLES = 10_000
TIME = np.arange(SAMPLES) * PERIOD


@cache
def perfect():
    return assess_recording(rest_record(0), AMBIENT)


def statuses(quality, name):
    return {check: result.status for check, result in check_results(quality, name).items()}


def faulty(name, value, **changes):
    """The perfect record with another true value in one channel [A, V or bar]."""
    rng = np.random.default_rng(1)
    record = with_channel(rest_record(0), name, readings(name, value, rng, SAMPLES))
    return assess_recording(replace(record, **changes), AMBIENT)


def test_a_perfect_bench_is_good_in_every_check():
    """Over all 20 checks and long and short records; the false alarms are to stay below 1 %."""
    for seed in range(6):
        quality = assess_recording(rest_record(seed, 2000 if seed % 4 else SAMPLES), AMBIENT)
        for name in CHANNELS:
            assert statuses(quality, name) == dict.fromkeys(CHECKS, "good"), seed


@pytest.mark.parametrize("name", CHANNELS)
def test_a_rest_record_gives_tables_2_and_3_back(name):
    """Within four standard errors: sigma/sqrt(n) of a mean, sigma/sqrt(2 n) of sigma."""
    channel, sigma = perfect().channels[name], SENSORS[name].noise
    assert STATISTICS[name].standard_deviation == sigma
    rounded = np.hypot(sigma, SENSORS[name].resolution / np.sqrt(12))
    assert channel.description.standard_deviation == pytest.approx(
        rounded, abs=4 * rounded / np.sqrt(2 * SAMPLES)
    )
    assert channel.trend.intercept + 2.5 * channel.trend.slope == pytest.approx(
        TREND_OFFSETS[name], abs=0.05 * sigma
    )
    assert channel.quantum == pytest.approx(SENSORS[name].resolution, rel=1e-6)


def test_offsets_of_a_record_at_rest_come_in_si_units():
    offsets = sensor_offsets(perfect())
    for name in CHANNELS:
        rest = 1.0 if name.startswith("p") else 0.0
        size = UNITS[name][1]
        error = offsets[name].error
        assert error == pytest.approx(2 * SENSORS[name].noise * size / np.sqrt(SAMPLES), rel=0.1)
        assert offsets[name].value == pytest.approx((TREND_OFFSETS[name] - rest) * size, abs=4 * error)


def test_no_offset_is_read_off_an_energised_record():
    record, rng = rest_record(0), np.random.default_rng(2)
    for name, value in {"I": 0.57, "U": 24.0, "p1": 12.0, "p2": 7.5, "p3": 12.0}.items():
        record = with_channel(record, name, readings(name, value, rng, SAMPLES))
    quality = assess_recording(record, AMBIENT)
    assert sensor_offsets(quality) == {}
    for name in CHANNELS:
        assert statuses(quality, name) == {**dict.fromkeys(CHECKS, "good"), "offset": "note"}
        assert worst_status(check_results(quality, name)) == "good"


@pytest.mark.parametrize(("name", "value"), [("p2", 1.4), ("U", 0.5)])
def test_a_wrong_offset(name, value):
    quality = faulty(name, value)
    assert statuses(quality, name) == {**dict.fromkeys(CHECKS, "good"), "offset": "bad"}
    assert sensor_offsets(quality) == {}


@pytest.mark.parametrize(("rate", "status"), [(0.002, "good"), (0.02, "doubt"), (0.1, "bad")])
def test_a_drift(rate, status):
    """10, 100 and 500 mbar over the record against an accuracy of 256."""
    quality = faulty("p3", 1.0 + rate * (TIME - 2.5))
    assert statuses(quality, "p3") == {**dict.fromkeys(CHECKS, "good"), "trend": status}
    assert (sensor_offsets(quality) == {}) == (status != "good")


@pytest.mark.parametrize(("factor", "status"), [(1.3, "good"), (2.0, "doubt"), (5.0, "bad")])
def test_noise_beyond_table_3(factor, status):
    noise = factor * SENSORS["p1"].noise * np.random.default_rng(5).standard_normal(SAMPLES)
    step = SENSORS["p1"].resolution
    quality = assess_recording(
        with_channel(rest_record(0), "p1", step * np.rint((1 + noise) / step)), AMBIENT
    )
    assert statuses(quality, "p1") == {**dict.fromkeys(CHECKS, "good"), "noise": status}


def test_a_stuck_code():
    quality = assess_recording(with_channel(rest_record(0), "p3", np.ones(SAMPLES)), AMBIENT)
    assert statuses(quality, "p3") == {"offset": "good", "resolution": "bad"}
    assert statuses(quality, "p2") == dict.fromkeys(CHECKS, "good")
    assert not any("p3" in pair for pair in quality.correlations)


def test_a_reading_that_stands_still_for_a_while_is_bad():
    """A cable that breaks for 100 ms, or a converter that clips for as long."""
    held = rest_record(0).p3 / 1e5
    held[3000:3200] = held[3000]
    quality = assess_recording(with_channel(rest_record(0), "p3", held), AMBIENT)
    assert statuses(quality, "p3") == {**dict.fromkeys(CHECKS, "good"), "resolution": "bad"}
    assert "lasts 100 ms" in channel_verdict(quality, "p3").text


def test_table_4_shows_crosstalk():
    rng = np.random.default_rng(4)
    source = rng.standard_normal(SAMPLES)
    record = with_channel(rest_record(0), "I", SENSORS["I"].measure(0 * source, source))
    signal = readings("U", 0.005 * source, rng, SAMPLES)
    quality = assess_recording(with_channel(record, "U", signal), AMBIENT)
    assert quality.correlations["I", "U"] == pytest.approx(0.005 / 0.0139, abs=0.04)
    assert abs(quality.correlations["p1", "p2"]) < 2 * white_noise_band(SAMPLES)


def test_a_reading_that_coarse_steps_hold_is_in_doubt_and_not_bad():
    record = with_channel(rest_record(0), "p3", np.ones(SAMPLES))
    quality = assess_recording(record, AMBIENT, steps={"p3": 5e3})
    assert statuses(quality, "p3") == {"offset": "good", "resolution": "doubt"}
    assert sensor_offsets(quality)["p3"].error == pytest.approx(5e3 / np.sqrt(12))


def test_too_short_a_record_is_refused():
    with pytest.raises(CampaignError, match="249 samples"):
        assess_recording(rest_record(0, 249), AMBIENT)
