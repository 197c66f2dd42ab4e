"""What the campaign leaves open of each rival's parameters."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.hypothesis import Estimate
from identification.gap.fit.linearisation import linearise
from identification.gap.fit.variable_projection import normal_equations, tolerances_as_slopes


@dataclass(frozen=True, kw_only=True)
class ParameterPosterior:
    """A Gaussian of an estimate's scaled vector, less its present value, and of all tolerances.

    k parameters [1] and m tolerances [standard deviations].
    """

    mean: NDArray
    """(k + m,)."""
    factor: NDArray
    """F of the covariance F F', (k + m, k + m)."""


def parameter_posteriors(
    problem: FittingProblem, estimates: Sequence[Estimate]
) -> list[ParameterPosterior]:
    """Posteriors of the estimates, linearised, given the campaign's fitted runs.

    Before the data a parameter is uniform over its range; the Gaussian prior has that variance.
    """
    posteriors = []
    linearised = linearise(problem, estimates, problem.fitted_runs)
    for estimate, runs in zip(estimates, linearised, strict=True):
        equations = normal_equations(
            [tolerances_as_slopes(run) for run in runs], problem.settings.largest_deviation
        )
        parameters = problem.parameters(estimate)
        widths = np.array([(p.high - p.low) / p.scale for p in parameters])
        prior = np.concatenate([12.0 / widths**2, np.ones(runs[0].tolerance_slopes.shape[1])])
        precision = equations.hessian + np.diag(prior)
        factor = np.linalg.inv(np.linalg.cholesky(precision)).T
        posteriors.append(
            ParameterPosterior(mean=factor @ (factor.T @ equations.gradient), factor=factor)
        )
    return posteriors
