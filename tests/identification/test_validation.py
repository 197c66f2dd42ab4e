"""The report's error measure, and held-out recordings: a wrong model is noticed."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from identification.recordings.recording import OUTPUTS, CampaignError
from identification.report_2003 import (
    CALIBRATION_CASES,
    SAMPLING_RATE,
    VALIDATION_CASE,
    partial_error,
    relative_error,
    total_error,
)
from identification.validation import WHITE, assess_whiteness, validate, validation_section
from tests.identification.twins import TRUE, problem


def statuses(validation):
    return [verdict.status for verdict in validation_section(validation).verdicts]


@pytest.mark.parametrize("seed", [1, 2])
def test_the_right_model_leaves_white_noise_of_the_sensors_size(seed):
    validation = validate(problem(seed), TRUE)
    assert [(r.recording, r.output) for r in validation.residuals] == [
        ("validation", o) for o in OUTPUTS
    ]
    for residual in validation.residuals:
        assert residual.rms == pytest.approx(1.0, abs=0.06)
        assert residual.whiteness.probability > WHITE
    assert statuses(validation) == ["good", "good"]


@pytest.mark.parametrize(("symbol", "output"), [("R", "I"), ("alphaMV", "p3"), ("alphaPV", "p2")])
def test_a_parameter_that_is_2_percent_off_is_doubted(symbol, output):
    validation = validate(problem(), TRUE.replace(**{symbol: 1.02 * TRUE[symbol]}))
    assert statuses(validation) == ["good", "doubt"]
    (residual,) = (r for r in validation.residuals if r.output == output)
    assert residual.whiteness.probability < WHITE
    assert output in validation_section(validation).verdicts[1].text


def test_a_total_error_above_the_limit_is_bad():
    validation = validate(problem(), TRUE.replace(alphaPV=0.21))
    assert validation.worst > 0.1
    assert statuses(validation) == ["bad", "doubt"]


def test_without_a_recording_that_was_held_out_there_is_no_validation():
    with pytest.raises(CampaignError, match="no recording with role 'validation': hold one out"):
        validate(replace(problem(), validation=()), TRUE)


SAMPLES, LAGS = 10_000, 200


def white(seed):
    return np.random.default_rng(seed).standard_normal(SAMPLES)


@pytest.mark.parametrize("phi", [0.5, 0.9])
def test_an_autoregressive_process_has_its_autocorrelation_and_is_not_white(phi):
    whiteness = assess_whiteness(np.asarray(signal.lfilter([1.0], [1.0, -phi], white(1))), LAGS)
    np.testing.assert_allclose(whiteness.autocorrelation[:4], phi ** np.arange(4), atol=0.06)
    assert whiteness.probability < 1e-10


TIME = np.linspace(0.0, 2.0, 2001)


def test_a_constant_offset_is_its_share_of_the_mean():
    reference = 5.0 + np.zeros_like(TIME)
    assert relative_error(reference, reference + 0.1, TIME) == pytest.approx(0.02)


def test_a_sine_of_error_is_its_effective_value():
    reference = 4.0 + np.zeros_like(TIME)
    error = relative_error(reference, reference + np.sin(2 * np.pi * TIME), TIME)
    assert error == pytest.approx(1 / np.sqrt(2) / 4, rel=1e-6)


def test_table_11_s_partial_errors_and_total_come_from_its_columns():
    """Test1's row of Table 11, and the total over its four partial errors [%]."""
    assert partial_error([np.array(e) for e in (1.7241, 1.9783, 6.5588)]) == pytest.approx(
        7.0643, abs=1e-4
    )
    partials = [np.array(e) for e in (7.0643, 8.1904, 7.2867, 4.7364)]
    assert total_error(partials) == pytest.approx(6.9375, abs=1e-3)


@pytest.mark.parametrize("case", [*CALIBRATION_CASES, VALIDATION_CASE])
def test_the_coil_is_off_as_long_and_as_often_as_stated(case):
    off = case.voltage(24.0, SAMPLING_RATE) == 0
    assert np.sum(off) / SAMPLING_RATE == pytest.approx(sum(case.openings))
    assert np.sum(np.diff(off.astype(int)) == 1) == len(case.openings)
