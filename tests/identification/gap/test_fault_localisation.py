"""Where the gap of a tank lies: regimes, the equation that lacks something, and its shape."""

from functools import cache

import numpy as np
import pytest

from docs.examples.tank import Tank, virtual_recordings
from identification.gap.fit.evidence import evaluate
from identification.gap.fit.fitting_problem import Estimate, FittingProblem
from identification.gap.fit.gaps import regime_gaps
from identification.gap.fit.recalibration import recalibrate
from identification.gap.locate.forcing import quadratic_forms, window_edges
from identification.gap.locate.localisation import Localisation, fit_processes, locate
from identification.gap.plant import noise_weighted, window_forcing

LEAK = 2e-3
"""Of the tank [1/s]."""


@cache
def recalibrated_tank(**truth: float) -> tuple[FittingProblem, Estimate, list]:
    problem, estimate = recalibrate(Tank(virtual_recordings(truth)))
    return problem, estimate, evaluate(problem, [estimate])[0].residuals


@cache
def located(**truth: float) -> Localisation:
    return locate(*recalibrated_tank(**truth), seed=4)


def test_a_lack_in_the_state_equation_is_found_there():
    found = located(leak=LEAK)
    assert found.equation_probabilities["f1"] > 0.99
    assert found.forcings[0].equation.name == "f1"
    assert found.forcings[0].explained > 0.5


def test_a_lag_of_the_sensor_is_no_lack_of_an_equation():
    found = located(lag=5.0)
    assert found.equation_probabilities["reading h"] > 0.9
    assert found.missing_term is None


def test_without_a_gap_nothing_is_missing():
    found = located()
    assert found.nothing_missing > 0.8
    assert sum(found.equation_probabilities.values()) == pytest.approx(1 - found.nothing_missing)
    assert found.missing_term is None


def test_the_shape_is_that_of_the_missing_term():
    """What a leak does beyond what the outlet's coefficient absorbs, over the level."""
    problem, estimate, _ = recalibrated_tank(leak=LEAK)
    shape = located(leak=LEAK).missing_term
    assert shape is not None
    assert shape.state == "h"
    assert shape.explained > 0.8
    c = problem.values(estimate)["c"]
    missing = -1e3 * (LEAK * shape.x - (c - 0.02) * np.sqrt(shape.x))
    inner = slice(len(shape.x) // 10, -len(shape.x) // 10)
    error = (shape.y - missing)[inner] / np.maximum(shape.sd[inner], 1e-3)
    assert np.sqrt(np.mean(error**2)) < 3


def test_a_forcing_is_recovered_but_for_noise_and_what_calibration_absorbs():
    """Readings are changed by a known forcing: what its estimate misses lies within the noise."""
    problem, estimate, _ = recalibrated_tank()
    plant, values = problem.plant, problem.candidate(estimate)
    equation = plant.equations[0]
    edges = window_edges(plant.runs[0].time, plant.states(values, 0), 80)
    truth = 20.0 * np.sin(np.linspace(0, 6, len(edges) - 1))
    forcing = window_forcing(equation, len(plant.runs[0].time), edges)
    change = plant.forced(values, 0, forcing) @ truth
    altered = FittingProblem(plant, problem.slopes)
    shift = noise_weighted(plant, 0, change).ravel()
    altered.measured = [problem.measured[0] + shift, *problem.measured[1:]]
    design, forms = quadratic_forms(altered, estimate, [0], 100.0)
    fit = fit_processes(forms, design)[0][0]
    error = fit.forcing - truth
    assert error @ forms[0].precision @ error < len(truth)
    assert truth @ forms[0].precision @ truth > 20 * len(truth)


def test_regime_gaps_are_root_mean_squares_with_intervals_that_hold_them():
    problem, estimate, residuals = recalibrated_tank(leak=LEAK)
    plant, values = problem.plant, problem.candidate(estimate)
    masks = [plant.regimes(values, r) for r in problem.all_runs]
    found = {gap.regime: gap for gap in regime_gaps(problem.plant, masks, residuals, 1, scale=0.005)}
    assert set(found) == {"filling", "draining"}
    for regime, gap in found.items():
        own = residuals[2][0][masks[2][regime]]
        assert gap.gap == pytest.approx(np.sqrt(np.mean(own**2)))
        assert 0 < gap.low < gap.gap < gap.high < np.inf


def test_a_regime_that_is_met_too_seldom_has_no_sure_gap():
    problem, _, residuals = recalibrated_tank()
    once = [{"once": np.arange(240) == (7 if r == 0 else -1)} for r in problem.all_runs]
    (gap,) = regime_gaps(problem.plant, once, residuals, 1, scale=0.005)
    assert (gap.low, gap.high, gap.held_out) == (0.0, np.inf, False)
