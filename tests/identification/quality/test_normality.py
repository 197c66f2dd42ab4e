"""A test of normality that allows for the converter's steps, and one that does not."""

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.diagnostic import normal_ad

from identification.quality.noise_tests import assess_normality

SAMPLES = 10_000


def rounded(noise, step, phase=0.3):
    """Noise on a grid that does not lie symmetrically about it."""
    return step * np.rint(noise / step + phase) - step * phase


def assessed(readings, step):
    return assess_normality(readings, np.full(len(readings), np.mean(readings)), step)


@pytest.mark.parametrize("step", [0.3, 0.6, 1.3])
def test_only_the_naive_test_rejects_normal_noise_for_being_rounded(step):
    """Steps of p2, I and U relative to their noise, on the report's bench."""
    readings = rounded(np.random.default_rng(0).standard_normal(SAMPLES), step)
    quality = assessed(readings, step)
    assert normal_ad(readings)[1] < 1e-4
    assert quality.probability > 0.01
    assert quality.standard_deviation == pytest.approx(1.0, abs=4 / np.sqrt(2 * SAMPLES))


def test_its_p_values_are_uniform_for_normal_noise():
    rng = np.random.default_rng(1)
    values = [
        assessed(rounded(rng.standard_normal(4000), 0.6, rng.random()), 0.6).probability
        for _ in range(80)
    ]
    assert stats.kstest(values, "uniform").pvalue > 0.01


@pytest.mark.parametrize(
    ("name", "noise"),
    [
        ("uniform", lambda rng: np.sqrt(12) * (rng.random(SAMPLES) - 0.5)),
        ("laplace", lambda rng: rng.laplace(scale=np.sqrt(0.5), size=SAMPLES)),
        ("exponential", lambda rng: rng.exponential(size=SAMPLES)),
        ("hum", lambda rng: rng.standard_normal(SAMPLES) / 3 + np.sin(np.arange(SAMPLES))),
    ],
)
def test_other_distributions_are_rejected_and_far_from_normal(name, noise):
    quality = assessed(rounded(noise(np.random.default_rng(2)), 0.6), 0.6)
    assert quality.probability < 1e-10, name
    assert quality.effect > 0.1, name


def test_a_missing_code_is_found():
    """A stuck bit: readings of one code appear as the next."""
    readings = rounded(np.random.default_rng(3).standard_normal(SAMPLES), 0.3, 0.0)
    readings[np.isclose(readings, 0.3)] = 0.6
    assert assessed(readings, 0.3).effect > 0.1


@pytest.mark.parametrize("drift", [1.0, 30.0])
def test_a_drift_does_not_count_against_normality(drift):
    rng = np.random.default_rng(4)
    line = np.linspace(-drift / 2, drift / 2, SAMPLES)
    normality = assess_normality(rounded(line + rng.standard_normal(SAMPLES), 0.6), line, 0.6)
    assert normality.probability > 0.01
    assert normality.standard_deviation == pytest.approx(1.0, abs=0.03)


def test_continuous_and_finely_divided_readings_are_grouped_by_the_test():
    noise = np.random.default_rng(5).standard_normal(SAMPLES)
    for readings, step in ((noise, 0.0), (rounded(noise, 0.01), 0.01)):
        quality = assessed(readings, step)
        assert quality.probability > 0.01
        assert quality.degrees < 40
