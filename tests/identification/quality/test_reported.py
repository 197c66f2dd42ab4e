"""What docs/explanation/identification.md says about the report's section 4, from printed tables."""

import numpy as np
import pytest
from scipy import stats

from epv_env.plant.channels import SENSORS
from identification.recordings.recording import CHANNELS
from tests.identification.quality.printed import (
    SAMPLES,
    STATISTICS,
    TREND_OFFSETS,
    TREND_SLOPES,
)


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
