"""Inputs lose their noise and nothing else, whatever the coil's voltage and the supply do."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.replay import model_inputs as drive
from identification.replay.model_inputs import model_inputs, smooth_supply, smooth_voltage
from tests.identification.twins import TRUE, exact_recording, truth

NOISE = 680.0
"""Standard deviation of p1's noise [Pa]."""

LIVES = {
    "sine": lambda time: 1e4 * np.sin(2 * np.pi * time / 0.5),
    "compressor that starts": lambda time: 1e4 * np.clip((time - 0.3) / 0.1, 0.0, 1.0),
    "compressor that fades in": lambda time: 1e4 * (1 - np.exp(-time / 0.1)),
}
"""What a supply may do on its own [Pa over s]."""


def supply_error(name, seed=0, life=lambda time: 0.0 * time):
    """smooth_supply less the truth [Pa], (samples,)."""
    recording = exact_recording(name, share=1.0, seed=seed)
    moved = life(recording.time)
    supply = smooth_supply(replace(recording, p1=recording.p1 + moved), TRUE)
    return supply - truth(name).channels["p1"] - moved


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("name", ["test1", "test4"])
def test_a_constant_voltage_loses_its_noise(name):
    voltage = smooth_voltage(exact_recording(name, share=1.0))
    assert np.max(np.abs(voltage - truth(name).channels["U"])) < 0.005


def test_a_voltage_that_sags_is_kept_as_it_was_read():
    """0.6 V/s, as when a battery is loaded; the coil off shows noise alone."""
    recording = exact_recording("test1", share=1.0)
    on = recording.energised
    sagging = replace(recording, U=recording.U - 0.6 * recording.time * on)
    voltage = smooth_voltage(sagging)
    later = on & (recording.time > 0.1)
    np.testing.assert_array_equal(voltage[later], sagging.U[later])
    assert set(np.diff(voltage[~on][:100])) == {0.0}


@pytest.mark.parametrize("name", ["test1", "hold", "long_open", "steps"])
def test_a_reservoir_s_pressure_is_found_within_a_millibar(name):
    assert rms(supply_error(name)) < 100.0
    assert np.max(np.abs(supply_error(name))) < 200.0


@pytest.mark.parametrize("life", LIVES)
@pytest.mark.parametrize("name", ["test1", "test4"])
def test_a_supply_with_a_life_of_its_own_is_followed_within_millibars(name, life):
    error = supply_error(name, life=LIVES[life])
    assert rms(error) < 0.25 * NOISE
    assert np.max(np.abs(error)) < 1000.0


@pytest.mark.parametrize("life", LIVES)
def test_the_air_balance_alone_would_miss_it(monkeypatch, life):
    monkeypatch.setattr(drive, "is_white", lambda residual, length: True)
    assert rms(supply_error("test4", life=LIVES[life])) > 0.5 * NOISE


def test_a_ripple_on_the_reading_at_all_times_does_not_enter_the_model():
    recording = exact_recording("test1", share=1.0)
    white = np.random.default_rng(0).standard_normal(len(recording))
    ripple = 2.0 * NOISE * np.asarray(lfilter([np.sqrt(1.0 - 0.95**2)], [1.0, -0.95], white))
    supply = smooth_supply(replace(recording, p1=recording.p1 + ripple), TRUE)
    assert rms(supply - truth("test1").channels["p1"]) < 0.5 * rms(ripple)


def test_consumed_air_is_drawn_from_the_supply():
    """What the circuit consumed went through the valve too."""
    recording = exact_recording("test1", share=1e-3)
    drawn = np.where((recording.time > 0.2) & (recording.time < 0.3), 0.02, 0.0)
    fallen = np.cumsum(drawn) * recording.period * TRUE["R_gas"] * TRUE["T_env"] / 0.08
    consuming = replace(recording, sigma_S=drawn, p1=recording.p1 - fallen)
    balance = drive._air_balance(consuming, TRUE)
    assert rms(balance - consuming.p1) < 100.0
    unaware = drive._air_balance(replace(consuming, sigma_S=0 * drawn), TRUE)
    assert rms(unaware - consuming.p1) > 300.0


def test_the_start_is_the_mean_of_the_hold():
    recording = exact_recording("test1", share=1.0)
    inputs = model_inputs(recording, TRUE)
    assert inputs.p2_start == pytest.approx(np.mean(recording.p2[:80]))
    assert inputs.p2_start == pytest.approx(truth("test1").channels["p2"][0], abs=4 * 980 / np.sqrt(80))
    assert inputs.U_start == pytest.approx(18.9, abs=0.006)
    assert inputs.p1_start == inputs.p1[0]


@pytest.mark.parametrize("name", ["test2"])
def test_a_supply_in_coarse_steps_loses_them(name):
    """The air balance stands in for stairs of 50 mbar: its error is far below their 14 mbar."""
    recording = exact_recording(name, share=1.0)
    coarse = replace(recording, p1=5e3 * np.rint(recording.p1 / 5e3))
    error = smooth_supply(coarse, TRUE) - truth(name).channels["p1"]
    assert rms(error) < 500.0
