"""Correlations and spectra of processes that have closed forms."""

import numpy as np
import pytest
from scipy import signal

from identification.quality.noise_tests import (
    assess_correlation,
    assess_whiteness,
    spectrum,
    white_noise_band,
)

SAMPLES, LAGS = 10_000, 200


def white(seed):
    return np.random.default_rng(seed).standard_normal(SAMPLES)


def autoregressive(seed, phi):
    """AR(1) with the given correlation of neighbours."""
    return np.asarray(signal.lfilter([1.0], [1.0, -phi], white(seed)))


def test_white_noise_passes():
    whiteness = assess_whiteness(white(0), LAGS)
    assert whiteness.autocorrelation.shape == (LAGS + 1,)
    assert whiteness.autocorrelation[0] == 1.0
    assert whiteness.probability > 0.01
    inside = np.abs(whiteness.autocorrelation[1:]) < white_noise_band(SAMPLES)
    assert np.mean(inside) == pytest.approx(0.95, abs=0.05)
    assert whiteness.inflation == pytest.approx(1.0, abs=1.0)


def test_ljung_box_seldom_alarms_on_white_noise():
    probabilities = [assess_whiteness(white(seed)[:4000], LAGS).probability for seed in range(40)]
    assert np.mean(np.array(probabilities) < 0.1) < 0.1 + 3 * np.sqrt(0.09 / 40)


@pytest.mark.parametrize("phi", [0.5, 0.9])
def test_an_autoregressive_process_has_its_autocorrelation_and_is_not_white(phi):
    whiteness = assess_whiteness(autoregressive(1, phi), LAGS)
    np.testing.assert_allclose(whiteness.autocorrelation[:4], phi ** np.arange(4), atol=0.06)
    assert whiteness.probability < 1e-10
    assert whiteness.inflation == pytest.approx((1 + phi) / (1 - phi), rel=0.3, abs=0.5)


def test_hum_is_named_by_its_frequency_and_correlation():
    time = np.arange(SAMPLES) / 2000
    whiteness = assess_whiteness(white(2) + np.sin(2 * np.pi * 50 * time), LAGS)
    assert 1000 * whiteness.peak_frequency == pytest.approx(50.0, abs=0.2)
    assert whiteness.peak == pytest.approx(0.5 / 1.5, abs=0.05)


def test_white_noise_has_a_flat_spectrum_of_sigma_squared_over_pi():
    density = spectrum(2 * white(3))
    low, high = density.band
    assert density.white == pytest.approx(4 / np.pi, rel=0.05)
    assert np.mean(density.density) == pytest.approx(density.white, rel=0.02)
    assert np.mean((density.density > low) & (density.density < high)) == pytest.approx(0.95, abs=0.06)
    assert 0 < density.frequency[0] < density.frequency[-1] < 1


def test_a_first_order_spectrum_is_its_closed_form():
    """sigma_e^2/pi / |1 - phi exp(-i w)|^2 per rad/sample, one-sided."""
    density = spectrum(autoregressive(4, 0.5))
    expected = 1 / np.pi / np.abs(1 - 0.5 * np.exp(-1j * np.pi * density.frequency)) ** 2
    np.testing.assert_allclose(np.log(density.density / expected), 0.0, atol=0.6)


@pytest.mark.parametrize("delay", [-7, 30])
def test_a_signal_that_follows_another_is_found_at_its_lag(delay):
    second = white(5)
    first = 0.6 * np.roll(second, delay) + 0.8 * white(6)
    pair = assess_correlation(first, second, LAGS)
    assert pair.crosscorrelation.shape == (2 * LAGS + 1,)
    assert pair.peak_lag == delay
    assert pair.peak == pytest.approx(0.6, abs=0.03)
    assert pair.peak_probability < 1e-10


def test_coloured_signals_count_as_fewer_samples():
    """Bartlett: two independent AR(1) have n (1 - phi^2)/(1 + phi^2) effective samples."""
    pair = assess_correlation(autoregressive(9, 0.9), autoregressive(10, 0.9), LAGS)
    assert pair.effective_samples == pytest.approx(SAMPLES * 0.19 / 1.81, rel=0.3)
    assert pair.probability > 1e-3
    assert pair.peak_probability > 1e-3
