"""Bounded least squares against SciPy's, for random, fixed and nearly singular numbers."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from identification.gap.variable_projection import bounded_minimiser


def problem(seed: int, n: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(40, n)) @ rng.normal(size=(n, n))
    target = columns @ rng.normal(0.0, 3.0, n) + rng.normal(size=40)
    return columns, target, -rng.uniform(0.0, 3.0, n), rng.uniform(0.0, 3.0, n)


@pytest.mark.parametrize("seed", range(20))
def test_it_is_the_bounded_minimiser(seed):
    columns, target, low, high = problem(seed)
    found = bounded_minimiser(columns.T @ columns, columns.T @ target, low, high)
    reference = lsq_linear(columns, target, (low, high), method="bvls", tol=1e-14).x
    assert np.any((found == low) | (found == high))
    assert found == pytest.approx(reference, abs=1e-7)


def test_a_number_without_a_range_stays():
    columns, target, low, high = problem(3)
    low[[0, 4]] = high[[0, 4]] = 0.0
    found = bounded_minimiser(columns.T @ columns, columns.T @ target, low, high)
    assert found[0] == found[4] == 0.0


def test_equal_columns_share_what_they_explain():
    columns, target, low, high = problem(5, n=3)
    columns = np.column_stack([columns, columns[:, 0]])
    low, high = np.append(low, -9.0), np.append(high, 9.0)
    found = bounded_minimiser(columns.T @ columns, columns.T @ target, low, high)
    reference = lsq_linear(columns, target, (low, high), method="bvls", tol=1e-14)
    left = columns @ found - target
    assert left @ left == pytest.approx(2.0 * reference.cost, rel=1e-6)
    assert np.all((low <= found) & (found <= high))
