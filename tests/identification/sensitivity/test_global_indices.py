"""Sobol on a function with known answers, and on the valve in a short form."""

import numpy as np
import pytest

from epv_env.plant.parameters import Parameters
from identification.sensitivity.global_indices import (
    ranges,
    sobol_indices,
    total_error_model,
)

ISHIGAMI = ("x1", "x2", "x3")
ISHIGAMI_BOUNDS = np.array([[-np.pi, np.pi]] * 3)


def ishigami(x):
    """Ishigami and Homma 1990, with a = 7, b = 0.1."""
    return np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def test_sobol_indices_of_the_ishigami_function():
    indices = sobol_indices(ishigami, ISHIGAMI, ISHIGAMI_BOUNDS, samples=4096, seed=1)
    assert indices.first == pytest.approx([0.3139, 0.4424, 0.0], abs=0.03)
    assert indices.total == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.03)


def test_the_valve_in_short_form_finds_what_matters():
    """Piston and exhaust weigh a hundred times as much as the masses."""
    p, symbols = Parameters.nominal(), ["d1", "dMVexh", "mMV", "mPV"]
    indices = sobol_indices(
        total_error_model(p, symbols), symbols, ranges(p, symbols), samples=16, seed=1
    )
    assert indices.total[:2].min() > 100 * indices.total[2:].max()
