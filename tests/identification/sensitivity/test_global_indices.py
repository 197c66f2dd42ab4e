"""Sobol and Morris on functions with known answers, and on the valve in a short form."""

import numpy as np
import pytest

from epv_env.plant.parameters import Parameters
from identification.sensitivity.global_indices import (
    morris_effects,
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


def test_elementary_effects_of_a_linear_function_are_its_slopes_times_the_ranges():
    bounds = np.array([[0.0, 1.0], [10.0, 14.0]])
    effects = morris_effects(
        lambda x: 3 * x[:, 0] - 2 * x[:, 1], ("a", "b"), bounds, trajectories=5, seed=1
    )
    assert effects.mean_absolute == pytest.approx([3.0, 8.0])
    assert effects.spread == pytest.approx([0.0, 0.0], abs=1e-9)


def test_screening_of_the_valve_finds_what_matters():
    """In a short form: piston and exhaust weigh a hundred times as much as the armature's mass."""
    p, symbols = Parameters.nominal(), ["d1", "dMVexh", "mMV", "mPV"]
    bounds = ranges(p, symbols)
    effects = morris_effects(total_error_model(p, symbols), symbols, bounds, trajectories=8, seed=1)
    assert effects.mean_absolute[:2].min() > 100 * effects.mean_absolute[2:].max()
