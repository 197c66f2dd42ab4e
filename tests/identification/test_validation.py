"""Held-out recordings: the right model leaves white noise, a wrong one is noticed."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from identification.recordings.recording import OUTPUTS, CampaignError
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
