"""Eliminating nuisances within their bounds: the same as one big least-squares problem."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from docs.examples.tank import Tank, virtual_recordings
from identification.gap.fit.evidence import evaluate
from identification.gap.fit.fitting_problem import Estimate, FittingProblem
from identification.gap.fit.gauss_newton import linearise
from identification.gap.fit.recalibration import recalibrate
from identification.gap.fit.variable_projection import (
    LARGEST_DEVIATION,
    LinearisedRun,
    bounded_minimiser,
    normal_equations,
    without_run_nuisances,
)

RNG = np.random.default_rng(2)
SD = np.array([0.3, 2.0])
PRECISION, VALUES = np.array([0.0, 30.0]), np.array([0.0, 0.7])
"""Of the priors of the two slopes, the first of which has none."""


def runs(count=3):
    return [
        LinearisedRun(
            residual=RNG.normal(size=40), slopes=RNG.normal(size=(40, 2)),
            slope_precision=PRECISION, slope_values=VALUES,
            run_slopes=RNG.normal(size=(40, 2)), run_values=0.5 * SD * RNG.normal(size=2), run_sd=SD,
            shared_slopes=RNG.normal(size=(40, 3)),
        )
        for _ in range(count)
    ]  # fmt: skip


def one_problem(given):
    """Matrix and right-hand side with all unknowns: 2 slopes, 3 shared, 2 per run."""
    blocks, right = [], []
    for r, run in enumerate(given):
        own = np.zeros((40, 2 * len(given)))
        own[:, 2 * r : 2 * r + 2] = run.run_slopes
        blocks.append(np.hstack([run.slopes, run.shared_slopes, own]))
        right.append(run.residual)
        prior = np.zeros((2, 5 + 2 * len(given)))
        prior[:, 5 + 2 * r : 7 + 2 * r] = np.diag(1 / SD)
        blocks.append(prior)
        right.append(-run.run_values / SD)
    blocks.append(np.hstack([np.diag(np.sqrt(PRECISION)), np.zeros((2, 3 + 2 * len(given)))]))
    right.append(-np.sqrt(PRECISION) * VALUES)
    blocks.append(np.hstack([np.zeros((3, 2)), np.eye(3), np.zeros((3, 2 * len(given)))]))
    right.append(np.zeros(3))
    return np.vstack(blocks), np.concatenate(right)


def test_the_reduced_equations_have_the_whole_problem_s_solution():
    given = runs()
    found = normal_equations(given)
    matrix, right = one_problem(given)
    solution, squares, *_ = np.linalg.lstsq(matrix, right, rcond=None)
    step = np.linalg.solve(found.hessian, found.gradient)
    np.testing.assert_allclose(step, solution[:2], rtol=1e-9)
    left = found.least - found.gradient @ step
    assert left == pytest.approx(squares[0], rel=1e-9)


def test_a_bounded_step_is_that_of_the_whole_bounded_problem():
    given = [replace(run, residual=200.0 * run.residual) for run in runs()]
    found = normal_equations(given)
    matrix, right = one_problem(given)
    ends = np.full(matrix.shape[1], np.inf)
    ends[:2], ends[2:5] = (0.05, 0.5), LARGEST_DEVIATION
    ends[5:] = LARGEST_DEVIATION * np.tile(SD, len(given))
    present = np.concatenate([np.zeros(5), *(run.run_values for run in given)])
    expected = lsq_linear(matrix, right, (-ends - present, ends - present), method="bvls")
    step, gain = found.step(-ends[:2], ends[:2], damping=0.0)
    np.testing.assert_allclose(step, expected.x[:2], atol=1e-8)
    assert np.any(np.abs(expected.x[2:5]) >= LARGEST_DEVIATION)
    assert found.chi_square - gain == pytest.approx(2 * expected.cost, rel=1e-9)
    assert found.chi_square > found.least


def problem(seed: int, n: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(40, n)) @ rng.normal(size=(n, n))
    target = columns @ rng.normal(0.0, 3.0, n) + rng.normal(size=40)
    return columns, target, -rng.uniform(0.0, 3.0, n), rng.uniform(0.0, 3.0, n)


@pytest.mark.parametrize("seed", range(5))
def test_it_is_the_bounded_minimiser(seed):
    columns, target, low, high = problem(seed)
    found = bounded_minimiser(columns.T @ columns, columns.T @ target, low, high)
    reference = lsq_linear(columns, target, (low, high), method="bvls", tol=1e-14).x
    assert np.any((found == low) | (found == high))
    assert found == pytest.approx(reference, abs=1e-7)


ZERO_SD = 5e-4
"""Of the gauge's zero in a run [m]."""


@cache
def with_zero(deviations: float) -> tuple[FittingProblem, Estimate]:
    """A recalibrated tank whose gauge is off in the first run; deviations: in `ZERO_SD` [1]."""
    tank = Tank(virtual_recordings({"c": 0.021}))
    tank.channels = (replace(tank.channels[0], noise=2e-3),)
    tank.runs[0].measured[:] += deviations * ZERO_SD
    return recalibrate(tank)


def judged(problem: FittingProblem, estimate: Estimate) -> float:
    """Sum of squares of readings and nuisances on the fitted runs, as the judgement sees them."""
    runs = linearise(problem, [estimate], problem.fitted_runs)[0]
    total = 0.0
    for run in runs:
        residual, step = without_run_nuisances(run, np.zeros(0))
        total += residual @ residual + np.sum(((run.run_values + step) / run.run_sd) ** 2)
    return float(total)


@pytest.mark.parametrize("deviations", [2.0, -30.0])
def test_fit_and_judgement_agree(deviations):
    problem, estimate = with_zero(deviations)
    assert estimate.converged
    assert judged(problem, estimate) == pytest.approx(estimate.chi_square, rel=1e-6)


def test_what_a_bounded_nuisance_cannot_follow_stays_in_the_residual():
    """A gauge that is off by thirty deviations: three are its zero, the rest is a gap."""
    problem, estimate = with_zero(30.0)
    residual = evaluate(problem, [estimate])[0].residuals[0]
    assert np.mean(residual) > 1.0
    sound, at_rest = with_zero(0.0)
    assert abs(np.mean(evaluate(sound, [at_rest])[0].residuals[0])) < 0.3
