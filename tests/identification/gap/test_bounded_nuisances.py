"""Nuisances stay within their bounds in the fit as in the judgement, and nothing jumps there."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from docs.examples.tank import Tank, virtual_recordings
from identification.gap.fit.evidence import evaluate
from identification.gap.fit.fitting_problem import Estimate, FittingProblem
from identification.gap.fit.gauss_newton import linearise
from identification.gap.fit.recalibration import recalibrate
from identification.gap.fit.variable_projection import without_run_nuisances

SD = 5e-4
"""Of the gauge's zero in a run [m]."""


@cache
def with_zero(deviations: float) -> tuple[FittingProblem, Estimate]:
    """A recalibrated tank whose gauge is off in the first run; deviations: in `SD` [1]."""
    tank = Tank(virtual_recordings({"c": 0.021}))
    tank.channels = (replace(tank.channels[0], noise=2e-3),)
    tank.runs[0].measured[:] += deviations * SD
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
