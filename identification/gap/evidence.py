"""What a refitted hypothesis leaves of the recordings, and the price of its parameters.

The price of each fitted parameter is Laplace's (MacKay 1992).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.fitting_problem import Estimate, FittingProblem, cause_places
from identification.gap.gauss_newton import linearise
from identification.gap.prediction import with_settled_runs
from identification.gap.variable_projection import (
    LinearisedRun,
    NormalEquations,
    normal_equations,
    without_run_nuisances,
)

BOUND_MARGIN = 1e-4
"""Share of a range [1] within which a parameter counts as lying at the bound: rounding."""

SMALLEST_EIGENVALUE = 1e-12
"""Eigenvalue of a correlation matrix below which it is rounding [1]."""


@dataclass(frozen=True, kw_only=True)
class EvaluatedHypothesis:
    """A refitted hypothesis with its residuals on all runs."""

    estimate: Estimate
    residuals: list[NDArray]
    """Per run (channels, samples) [noise deviations], nuisance parameters accounted for; 0 at untrusted
    readings."""
    squares: NDArray
    """Sums of squared residuals over all runs, (channels,) [1]."""
    nuisance_penalty: float
    """Half the squared deviations of all nuisance parameters from their centres [nats]."""
    tolerances: NDArray
    """Tolerances that the fitted runs determine, (m,) [standard deviations from the centres]."""
    covariance: NDArray
    """Of calibrated parameters and parameters of causes for white noise, all else free, (k, k) [SI]."""
    at_bound: bool
    """Whether a parameter of a cause lies at a bound: the recordings ask for what cannot be."""

    @property
    def converged(self) -> bool:
        """Whether the fit has converged."""
        return self.estimate.converged

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the causes."""
        return tuple(cause.name for cause in self.estimate.hypothesis.causes)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the causes."""
        return self.estimate.hypothesis.labels

    @property
    def titles(self) -> tuple[str, ...]:
        """The causes for people."""
        return self.estimate.hypothesis.titles

    def price(self, inflation: float, least: float) -> float:
        """Log of the ranges of the causes' parameters over what the data leave (Laplace) [nats].

        Together, or one cause after the other with at least `least` each, whichever is more.

        Args:
            inflation: of the parameters' variance by correlated readings and by discrepancy [1].
            least: price of a cause [nats].
        """
        parameters = self.estimate.hypothesis.parameters
        first = len(self.covariance) - len(parameters)
        widths = np.array([abs(p.high - p.low) for p in parameters])
        covariance = self.covariance[first:, first:] / np.outer(widths, widths)
        # Before the data a parameter is uniform over its range, whose variance is a twelfth.
        precision = np.linalg.pinv(inflation * covariance) + 12.0 * np.eye(len(widths))
        together = 0.5 * float(np.linalg.slogdet(precision / (2.0 * np.pi))[1])
        own = -0.5 * np.log(2.0 * np.pi * np.minimum(inflation * np.diag(covariance), 1.0))
        each = [float(np.sum(own[self._place(place)])) for _, place, _ in cause_places(self.estimate)]
        return max(together, sum(max(alone, least) for alone in each))

    def _place(self, place: slice) -> slice:
        """Place of a cause's parameters among those of all causes."""
        first = self.estimate.cause_start
        return slice(place.start - first, place.stop - first)


def evaluate(problem: FittingProblem, estimates: Sequence[Estimate]) -> list[EvaluatedHypothesis]:
    """Each estimate on all runs.

    The vector has seen the fitted runs only; nuisance parameters, which have priors, adapt to every run.
    """
    if not estimates:
        return []
    estimates = [with_settled_runs(problem, estimate) for estimate in estimates]
    linearised = linearise(problem, estimates, problem.all_runs)
    return [
        evaluate_linearised(problem, estimate, runs)
        for estimate, runs in zip(estimates, linearised, strict=True)
    ]


def evaluate_linearised(
    problem: FittingProblem, estimate: Estimate, runs: Sequence[LinearisedRun]
) -> EvaluatedHypothesis:
    """An estimate on all runs, linearised."""
    tolerances = normal_equations(runs).tolerances
    freed = [without_run_nuisances(run, tolerances) for run in runs]
    residuals = [
        residual.reshape(run.measured.shape)
        for (residual, _), run in zip(freed, problem.plant.runs, strict=True)
    ]
    fitted = normal_equations([runs[r] for r in problem.fitted_runs])
    scales = [parameter.scale for parameter in problem.parameters(estimate)]
    deviations = _squared_deviations(runs, [step for _, step in freed], tolerances)
    return EvaluatedHypothesis(
        estimate=estimate,
        residuals=residuals,
        squares=np.sum([np.sum(residual**2, axis=1) for residual in residuals], axis=0),
        nuisance_penalty=0.5 * deviations,
        tolerances=fitted.tolerances,
        covariance=_covariance(fitted) * np.outer(scales, scales),
        at_bound=_at_bound(estimate),
    )


def _squared_deviations(
    runs: Sequence[LinearisedRun], steps: Sequence[NDArray], tolerances: NDArray
) -> float:
    """Squared deviations of all nuisance parameters from their centres [1]."""
    return float(tolerances @ tolerances) + sum(
        float(np.sum(((run.run_values + step) / run.run_sd) ** 2))
        for run, step in zip(runs, steps, strict=True)
    )


def _covariance(equations: NormalEquations) -> NDArray:
    """Covariance of the scaled vector (k, k) [1]; wide, but finite, where the recordings say nothing."""
    size = np.sqrt(np.diag(equations.hessian) + 1e-9)  # a parameter may have no effect at all
    values, vectors = np.linalg.eigh(equations.hessian / np.outer(size, size))
    return (vectors / np.maximum(values, SMALLEST_EIGENVALUE)) @ vectors.T / np.outer(size, size)


def _at_bound(estimate: Estimate) -> bool:
    """Whether a cause's parameter lies at an end of its range and is not merely nominal there."""
    for p, scaled in zip(estimate.hypothesis.parameters, estimate.cause_vector, strict=True):
        low, high = sorted((p.low, p.high))
        value, margin = scaled * p.scale, BOUND_MARGIN * (high - low)
        if min(value - low, high - value) < margin and abs(value - p.nominal) > margin:
            return True
    return False
