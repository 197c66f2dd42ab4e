"""Tables 2 and 3 on signals whose statistics are known."""

import numpy as np
import pytest

from identification.quality.channel import descriptive_statistics, run_limit
from identification.recordings.recording_checks import longest_run

TIME = np.arange(10_000) / 2000


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


def test_a_signal_that_never_changes_has_no_shape():
    statistics = descriptive_statistics(np.zeros(1000), greatest=1.0)
    assert statistics.standard_deviation == 0.0
    assert np.isinf(statistics.signal_to_noise)
    assert np.isnan([statistics.outlier_factor, statistics.kurtosis, statistics.skewness]).all()


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
