"""The model on recorded inputs: batches change nothing, and the bench's truth comes back."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from identification.recordings.recording import OUTPUTS
from identification.replay import replay
from identification.replay.model_inputs import model_inputs
from identification.replay.replay import SHIFTS, Replay
from tests.identification.twins import TRUE, exact_recording, truth

CANDIDATES = {
    "alphaMV": TRUE["alphaMV"] * np.array([1.0, 1.05, 0.9]),
    "R": TRUE["R"] * np.array([1.0, 0.98, 1.03]),
}


@cache
def mixed():
    """Drives of different lengths and rates."""
    recordings = [exact_recording("test1"), exact_recording("test4", 500.0), exact_recording("hold")]
    return [model_inputs(recording, TRUE) for recording in recordings]


def test_many_candidates_are_each_alone_to_the_bit():
    shifts = [[0.0, 500.0, -500.0], [0.0, 2e-4, -1e-4], [1e-4, 0.0, 3e-4]]
    candidates = {**CANDIDATES, **dict(zip(SHIFTS, np.array(shifts), strict=True))}
    together = Replay(mixed()[:1], TRUE).outputs(candidates)[0]
    for i in range(3):
        one = {symbol: values[i : i + 1] for symbol, values in candidates.items()}
        alone = Replay(mixed()[:1], TRUE).outputs(one)[0]
        np.testing.assert_array_equal(alone[:, :, 0], together[:, :, i])


def test_recordings_of_other_lengths_and_rates_are_each_alone_to_the_bit():
    drives = mixed()
    together = Replay(drives, TRUE).outputs(CANDIDATES)
    for drive, found in zip(drives, together, strict=True):
        assert found.shape == (len(OUTPUTS), len(drive.U), 3)
        np.testing.assert_array_equal(Replay([drive], TRUE).outputs(CANDIDATES)[0], found)


@pytest.mark.parametrize(("largest", "batches"), [(1, 3), (9000, 2)])
def test_smaller_batches_change_nothing(largest, batches, monkeypatch):
    whole = Replay(mixed(), TRUE).outputs(CANDIDATES)
    monkeypatch.setattr(replay, "LARGEST_BATCH", largest)
    parts = Replay(mixed(), TRUE)
    assert len(parts._groups(3, range(len(mixed())))) == batches
    for one, other in zip(whole, parts.outputs(CANDIDATES), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("name", ["test1", "test4"])
def test_the_truth_s_parameters_give_the_truth_back(name):
    """Through the smoothed inputs: p2 within 0.1 mbar, p3 within 0.1 mbar, I within 0.02 mA."""
    outputs = Replay([model_inputs(exact_recording(name), TRUE)], TRUE).outputs(
        {"R": np.array([TRUE["R"]])}
    )
    for output, model, limit in zip(OUTPUTS, outputs[0][:, :, 0], (10.0, 10.0, 2e-5), strict=True):
        assert np.max(np.abs(model - truth(name).channels[output])) < limit


def test_consumed_air_is_missing_from_the_circuit():
    """A constant flow m over the time t lowers p2 by R T m t / V2 while the valve is shut."""
    drive = mixed()[0]
    leaking = replace(drive, sigma_S=np.full(len(drive.U), 1e-3))
    tight, leaky = (
        found[0, :, 0] for found in Replay([drive, leaking], TRUE).outputs({"R": np.ones(1) * 42})
    )
    lost = TRUE["R_gas"] * TRUE["T_env"] * 1e-3 * 0.05 / TRUE["V2"]
    assert (tight - leaky)[100] == pytest.approx(lost, rel=1e-6)


def test_a_supply_that_a_sensor_reads_too_high_is_replayed_as_it_was():
    recording = exact_recording("test1")
    high = replace(recording, p1=1.01 * recording.p1)
    drives = [model_inputs(each, TRUE) for each in (recording, high)]
    true, found = Replay(drives, TRUE).outputs({"g_p1": np.array([[0.0, 0.01]])})
    np.testing.assert_allclose(found, true, rtol=1e-6, atol=1e-7)
    uncorrected = Replay(drives[1:], TRUE).outputs({"g_p1": np.zeros(1)})[0]
    assert np.max(np.abs(uncorrected - true)[1]) > 1e3  # p3 [Pa]


def test_a_start_of_p2_that_a_sensor_reads_wrong_is_replayed_as_it_was():
    """The valve is the same; its p2 is shown with the sensor's scale error and bias."""
    drive = mixed()[0]
    wrong = replace(drive, p2_start=1.02 * drive.p2_start + 3e3)
    errors = {"g_p2": np.array([[0.0, 0.02]]), "b_p2": np.array([[0.0, 3e3]])}
    true, found = Replay([drive, wrong], TRUE).outputs(errors)
    np.testing.assert_allclose(found[0], 1.02 * true[0] + 3e3, rtol=1e-9)
    np.testing.assert_allclose(found[1:], true[1:], rtol=1e-9)


def test_a_candidate_that_cannot_be_integrated_is_nan_and_harms_no_other():
    drive = model_inputs(cut(), TRUE)
    outputs = Replay([drive], TRUE).outputs({"alphaMV": np.array([TRUE["alphaMV"], np.nan])})[0]
    alone = Replay([drive], TRUE).outputs({"alphaMV": np.array([TRUE["alphaMV"]])})[0]
    np.testing.assert_array_equal(outputs[:, :, :1], alone)
    assert np.all(np.isnan(outputs[:2, 1:, 1]))


def cut():
    """The first 20 ms at 500 Hz: what cannot be integrated takes a long time to fail."""
    whole = exact_recording("test4", 500.0, share=1.0)
    short = {name: getattr(whole, name)[:10] for name in ("I", "U", "p1", "p2", "p3", "sigma_S")}
    return replace(whole, **short)
