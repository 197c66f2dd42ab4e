"""The block bootstrap: sums are kept, weights have the variance that few blocks call for."""

import numpy as np
import pytest
from scipy import signal, stats

from identification.block_bootstrap import (
    block_length,
    block_starts,
    block_sums,
    block_weights,
    interval,
)


@pytest.mark.parametrize("samples", [7, 40, 1301, 1349])
def test_blocks_hold_every_sample_once(samples):
    series = np.arange(2.0 * samples).reshape(2, samples)
    sums = block_sums(series, block_length(samples, 10.0))
    assert len(sums) == len(block_starts(samples, block_length(samples, 10.0))) >= 2
    np.testing.assert_allclose(sums.sum(axis=0), series.sum(axis=1))


def test_weights_of_a_run_add_up_to_its_blocks():
    weights = block_weights([5, 30], 1)
    np.testing.assert_array_equal(weights[0], 1)
    assert np.all(weights >= 0)
    np.testing.assert_allclose(weights[:, :5].sum(axis=1), 5)
    np.testing.assert_allclose(weights[:, 5:].sum(axis=1), 30)


def test_weights_vary_as_student_says():
    weights = block_weights([12], 1)
    student = stats.t.ppf(0.975, 11) / stats.norm.ppf(0.975)
    assert np.var(weights[1:]) == pytest.approx(student**2, rel=0.06)


def test_the_interval_of_a_correlated_mean_covers_it():
    """Readings that are correlated over part of a block; independent ones would be trusted too soon."""
    rng = np.random.default_rng(2)
    hits = []
    for seed in range(300):
        noise = np.asarray(signal.lfilter([1.0], [1.0, -0.8], rng.standard_normal(1400)))[200:]
        weights = block_weights([20], seed)
        means = weights @ block_sums(noise[None], block_length(1200, 10.0))[:, 0] / 1200
        found = interval(means)
        hits.append(found.low <= 0 <= found.high)
    assert np.mean(hits) == pytest.approx(0.95, abs=0.04)
