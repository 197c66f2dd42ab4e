"""Eliminating nuisances: the same answer as one big least-squares problem with prior rows."""

import numpy as np
import pytest

from identification.gap.normal import Linear, freed, normal

RNG = np.random.default_rng(2)
SD = np.array([0.3, 2.0])


def runs(count=3):
    return [
        Linear(
            residual=RNG.normal(size=40), slopes=RNG.normal(size=(40, 2)),
            local=RNG.normal(size=(40, 2)), local_value=RNG.normal(size=2), local_sd=SD,
            shared=RNG.normal(size=(40, 3)),
        )
        for _ in range(count)
    ]  # fmt: skip


def one_problem(given):
    """Matrix and right-hand side with all unknowns: 2 slopes, 3 shared, 2 per run."""
    blocks, right = [], []
    for r, run in enumerate(given):
        own = np.zeros((40, 2 * len(given)))
        own[:, 2 * r : 2 * r + 2] = run.local
        blocks.append(np.hstack([run.slopes, run.shared, own]))
        right.append(run.residual)
        prior = np.zeros((2, 5 + 2 * len(given)))
        prior[:, 5 + 2 * r : 7 + 2 * r] = np.diag(1 / SD)
        blocks.append(prior)
        right.append(-run.local_value / SD)
    blocks.append(np.hstack([np.zeros((3, 2)), np.eye(3), np.zeros((3, 2 * len(given)))]))
    right.append(np.zeros(3))
    return np.vstack(blocks), np.concatenate(right)


def test_the_reduced_equations_have_the_whole_problem_s_solution():
    given = runs()
    found = normal(given)
    matrix, right = one_problem(given)
    solution, squares, *_ = np.linalg.lstsq(matrix, right, rcond=None)
    step = np.linalg.solve(found.hessian, found.gradient)
    np.testing.assert_allclose(step, solution[:2], rtol=1e-9)
    left = found.chi_square - found.gradient @ step
    assert left == pytest.approx(squares[0], rel=1e-9)


def test_freed_residuals_are_what_the_whole_problem_leaves():
    given = runs()
    at_rest = [Linear(**{**run.__dict__, "slopes": np.zeros((40, 2))}) for run in given]
    found = normal(at_rest)
    matrix, right = one_problem(given)
    solution = np.linalg.lstsq(matrix[:, 2:], right, rcond=None)[0]
    np.testing.assert_allclose(found.shared, solution[:3], rtol=1e-9)
    for r, run in enumerate(given):
        residual, step = freed(run, found.shared)
        np.testing.assert_allclose(step, solution[3 + 2 * r : 5 + 2 * r], rtol=1e-9)
        expected = run.residual - run.shared @ solution[:3] - run.local @ step
        np.testing.assert_allclose(residual, expected, rtol=1e-9)
