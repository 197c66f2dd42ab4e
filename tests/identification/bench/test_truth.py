"""The bench: SciPy's trajectories, air that is conserved, and the sensors of Tables 1 to 3."""

from functools import cache

import numpy as np
import pytest

from epv_env.plant.channels import SENSORS
from epv_env.plant.equations import State
from identification.bench.programmes import DIAGNOSIS_SUITE
from identification.bench.session import (
    RESERVOIR_VOLUME,
    initial_state,
    measured_campaign,
    measured_recording,
)
from identification.recordings.campaign_files import read_campaign, write_campaign
from identification.recordings.recording import CHANNELS, HOLD, UNITS
from tests.identification.twins import PROGRAMMES, REPORT, SWITCHING, TRUE, truth, twin
from tests.reference.hybrid_automaton import piecewise_schedule
from tests.reference.reference_simulation import simulate_reference

SETTLED = 0.03
"""After a switching the armature rests within this [s]."""


def volumes(true, reservoir=RESERVOIR_VOLUME):
    """Air in the reservoirs, the circuit and the control chamber [kg], (samples,)."""
    RT = TRUE["R_gas"] * TRUE["T_env"]
    held = reservoir * true.channels["p1"] + TRUE["V2"] * true.channels["p2"]
    return (held + TRUE["V3"] * true.channels["p3"]) / RT


def since_switching(true):
    """Time since the coil was last switched [s], (samples,)."""
    switched = np.flatnonzero(np.diff(true.channels["U"])) + 1
    index = np.arange(len(true.channels["U"]))
    last = np.array([max((s for s in switched if s <= i), default=0) for i in index])
    return (index - last) * true.period


@cache
def by_scipy(name, reservoir=RESERVOIR_VOLUME) -> State:
    """The states behind a recording by another integrator; both share the right-hand side alone."""
    true = truth(name)
    start, U = initial_state(TRUE, true.programme), true.channels["U"]
    time = np.arange(len(U)) * true.period
    schedule = piecewise_schedule(TRUE, start, time, U=U[:-1], reservoir_volume=reservoir)
    return simulate_reference(schedule, time, rtol=1e-8).state


def assert_agrees(true, state):
    for pressure in ("p1", "p2", "p3"):
        assert np.max(np.abs(getattr(state, pressure) - true.channels[pressure])) < 20.0
    assert np.max(np.abs(state.I - true.channels["I"])) < 2e-5


@pytest.mark.parametrize("name", [p.name for p in DIAGNOSIS_SUITE if p.U_on])
def test_the_voltage_is_on_or_off_as_the_programme_says(name):
    U, programme = truth(name).channels["U"], PROGRAMMES[name]
    assert set(U) == {0.0, programme.U_on}
    assert np.all(U[: round(HOLD * 2000)] == programme.U_on)
    assert np.sum(U == 0) / 2000 == pytest.approx(sum(programme.case.openings))
    assert (len(U) - 1) / 2000 == pytest.approx(programme.case.duration)


@pytest.mark.parametrize("name", [p.name for p in DIAGNOSIS_SUITE if p.U_on])
def test_scipy_finds_the_same(name):
    """20 Pa are a twentieth of an ADC step."""
    assert_agrees(truth(name), by_scipy(name))


def test_another_supply_is_noticed():
    with pytest.raises(AssertionError):
        assert_agrees(truth("test1"), by_scipy("test1", reservoir=1.05 * RESERVOIR_VOLUME))


@pytest.mark.parametrize("name", ["test1", "hold"])
def test_with_the_coil_on_the_air_of_the_three_volumes_stays(name):
    """The exhaust is shut: what the reservoirs lose, the circuit and the control chamber gain."""
    true = truth(name)
    shut = (true.channels["U"] > 0) & (since_switching(true) > SETTLED)
    last = shut & (np.cumsum(true.channels["U"] == 0) == np.sum(true.channels["U"] == 0))
    air = volumes(true)[last]
    drawn = volumes(true)[0] - RESERVOIR_VOLUME * true.channels["p1"][-1] / (
        TRUE["R_gas"] * TRUE["T_env"]
    )
    assert np.sum(last) > 50
    assert np.ptp(air) < 1e-6 * drawn


@pytest.mark.parametrize("name", SWITCHING)
def test_over_a_recording_the_air_falls_by_what_the_control_chamber_vents(name):
    """Each opening vents a good part of the chamber's filling."""
    true = truth(name)
    lost = volumes(true)[0] - volumes(true)[-1]
    filling = TRUE["V3"] * true.channels["p3"][0] / (TRUE["R_gas"] * TRUE["T_env"])
    vented = by_scipy(name).air_vented[-1]
    assert lost == pytest.approx(vented, rel=1e-3)
    assert 0.3 < lost / (filling * len(true.programme.case.openings)) < 1.0


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
