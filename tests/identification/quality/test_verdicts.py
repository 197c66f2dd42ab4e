"""A perfect bench passes every check; each kind of fault fails its own."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import stats

from epv_env.plant.channels import SENSORS
from identification.quality.assessment import assess_recording, sensor_offsets, white_noise_band
from identification.quality.channel import descriptive_statistics, run_limit
from identification.quality.section import (
    CHECKS,
    as_json,
    channel_verdict,
    check_results,
    quality_section,
    worst_status,
)
from identification.recordings.plausibility import longest_run
from identification.recordings.recording import CHANNELS, UNITS, CampaignError
from identification.report.page import Picture, Table
from tests.identification.quality.printed import STATISTICS, TREND_OFFSETS, TREND_SLOPES
from tests.identification.quality.records import AMBIENT, PERIOD, readings, rest_record, with_channel

SAMPLES = 10_000
"""Of the report's record: 5 s at 2000 Hz."""
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


def test_a_sine_has_its_closed_forms():
    statistics = descriptive_statistics(2 * np.sin(2 * np.pi * 10 * TIME), greatest=20.0)
    assert statistics.arithmetic_mean == pytest.approx(0.0, abs=1e-12)
    assert statistics.trimmed_mean == pytest.approx(0.0, abs=1e-12)
    assert statistics.median == pytest.approx(0.0, abs=1e-12)
    assert statistics.standard_deviation == pytest.approx(np.sqrt(2), rel=1e-4)
    assert statistics.interquartile_range == pytest.approx(2 * np.sqrt(2), rel=1e-2)
    assert statistics.absolute_deviation == pytest.approx(4 / np.pi, rel=1e-3)
    assert statistics.range == pytest.approx(4.0)
    assert statistics.signal_to_noise == pytest.approx(20 * np.log10(20 / np.sqrt(2)), abs=1e-3)
    assert statistics.outlier_factor == pytest.approx(np.sqrt(2), rel=1e-4)
    assert statistics.kurtosis == pytest.approx(1.5)
    assert statistics.skewness == pytest.approx(0.0, abs=1e-9)


def test_runs():
    coin = np.random.default_rng(0).integers(2, size=10_000)
    assert longest_run(np.array([1, 0, 0, 1, 1, 1, 0], dtype=bool)) == (3, 3)
    assert longest_run(np.zeros(7, dtype=bool)) == (0, 0)
    assert run_limit(coin, rounding=0.0) == pytest.approx(np.log2(1e8), abs=2)
    assert longest_run(np.diff(coin) == 0)[1] + 1 < run_limit(coin, rounding=0.0)


def test_a_drift_does_not_shorten_the_run_that_is_allowed():
    """The commonest reading of a drifting signal is rare, but not while the signal is there."""
    drifting = np.rint(np.linspace(0, 1000, 10_000))
    limit = run_limit(drifting, rounding=1.0)
    assert limit == pytest.approx(np.log(1e-8) / np.log(0.383), abs=2)


@cache
def qualities():
    """A perfect record, and one with a channel that never changes."""
    stuck = with_channel(rest_record(1, 2000), "U", np.zeros(2000))
    return assess_recording(rest_record(0, 2000), AMBIENT), assess_recording(stuck, AMBIENT)


@pytest.mark.parametrize("which", [0, 1])
def test_section_and_json_are_complete(which):
    section = quality_section(qualities()[which])
    assert [verdict.status for verdict in section.verdicts].count("good") == 5 - which
    assert sum(isinstance(block, Picture) for block in section.blocks) == 1
    for table in (block for block in section.blocks if isinstance(block, Table)):
        assert {len(row) for row in table.rows} == {len(table.columns)}
    content = json.loads(json.dumps(as_json(qualities()[which]), allow_nan=False))
    assert content["at_rest"] is True
    assert list(content["channels"]) == list(CHANNELS)
    assert len(content["correlations"]) == (10, 6)[which]
    assert content["channels"]["I"]["status"] == "good"
    assert (content["channels"]["U"]["statistics"]["kurtosis"] is None) == bool(which)


def chance_of_staying_below(factor):
    """That none of n independent normal samples exceeds the factor."""
    return (1 - 2 * stats.norm.sf(factor)) ** SAMPLES


def test_trends_are_insignificant_and_offsets_small():
    for name in CHANNELS:
        sensor, sigma = SENSORS[name], STATISTICS[name].standard_deviation
        assert abs(TREND_SLOPES[name]) < 1.8 * sigma * np.sqrt(12 / SAMPLES) / 5
        offset = TREND_OFFSETS[name] - name.startswith("p")
        assert abs(offset) < 0.029 * sensor.accuracy * sensor.high


def test_outlier_factors_are_what_chance_makes_them_or_less():
    p3, step = STATISTICS["p3"], SENSORS["p3"].resolution
    assert chance_of_staying_below(4.0) == pytest.approx(0.53, abs=0.005)
    assert chance_of_staying_below(p3.outlier_factor) == pytest.approx(2e-9, rel=0.2)
    rounded = p3.outlier_factor + step / 2 / p3.standard_deviation
    assert chance_of_staying_below(rounded) == pytest.approx(2e-4, rel=0.2)


@pytest.mark.parametrize(("name", "errors"), [("I", 8.6), ("U", 5.8), ("p3", 7.4)])
def test_kurtosis_lies_below_that_of_normal_noise(name, errors):
    values = (3 - STATISTICS[name].kurtosis) / np.sqrt(24 / SAMPLES)
    assert values == pytest.approx(errors, abs=0.06)
