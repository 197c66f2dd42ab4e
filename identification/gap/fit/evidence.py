"""What a refitted hypothesis leaves of the recordings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import Estimate, FittingProblem
from identification.gap.fit.gauss_newton import linearise
from identification.gap.fit.prediction import with_settled_runs
from identification.gap.fit.variable_projection import (
    LinearisedRun,
    NormalEquations,
    normal_equations,
    without_run_nuisances,
)


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
    law_penalty: float
    """The same of laws and of what else the causes have a prior for [nats]."""
    tolerances: NDArray
    """Tolerances that the fitted runs determine, (m,) [standard deviations from the centres]."""
    covariance: NDArray
    """Of calibrated parameters and parameters of causes for white noise, all else free, (k, k) [SI]."""
    unusual: bool
    """Whether a parameter of a cause lies at an end of its range."""

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
        return tuple(cause.title for cause in self.estimate.hypothesis.causes)

    @property
    def label(self) -> str:
        """All causes in one line, as in files."""
        return " + ".join(self.labels)

    @property
    def title(self) -> str:
        """All causes in one line, for people."""
        return " + ".join(self.titles)


def misfit(evaluated: EvaluatedHypothesis) -> float:
    """Sum of squares of all channels, nuisance parameters and laws [1]."""
    return float(evaluated.squares.sum()) + 2.0 * (evaluated.nuisance_penalty + evaluated.law_penalty)


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
    shared = normal_equations(runs).shared
    freed = [without_run_nuisances(run, shared) for run in runs]
    residuals = [
        residual.reshape(run.measured.shape)
        for (residual, _), run in zip(freed, problem.plant.runs, strict=True)
    ]
    fitted = normal_equations([runs[r] for r in problem.fitted_runs])
    scales = [parameter.scale for parameter in problem.parameters(estimate)]
    # Squared deviations of all nuisance parameters from their centres.
    deviations = float(shared @ shared) + sum(
        float(np.sum(((run.run_values + step) / run.run_sd) ** 2))
        for run, (_, step) in zip(runs, freed, strict=True)
    )
    precision, values = problem.priors(estimate)
    return EvaluatedHypothesis(
        estimate=estimate,
        residuals=residuals,
        squares=np.sum([np.sum(residual**2, axis=1) for residual in residuals], axis=0),
        nuisance_penalty=0.5 * deviations,
        law_penalty=0.5 * float(precision @ values**2),
        tolerances=fitted.shared,
        covariance=_covariance(fitted) * np.outer(scales, scales),
        unusual=_unusual(estimate),
    )


def _covariance(equations: NormalEquations) -> NDArray:
    """Covariance of the scaled vector (k, k) [1]; wide, but finite, where the recordings say nothing."""
    size = np.sqrt(np.diag(equations.hessian) + 1e-9)  # a parameter may have no effect at all
    values, vectors = np.linalg.eigh(equations.hessian / np.outer(size, size))
    root = vectors / np.sqrt(np.maximum(values, 1e-12)) / size[:, None]
    return root @ root.T  # symmetric to the last digit, which the product with the eigenvalues is not


def _unusual(estimate: Estimate) -> bool:
    """Whether a cause's parameter lies at an end of its range and is not merely nominal there."""
    sizes = estimate.vector[estimate.cause_start :]
    for p, scaled in zip(estimate.hypothesis.cause_parameters, sizes, strict=True):
        low, high = sorted((p.low, p.high))
        value, margin = scaled * p.scale, 1e-4 * (high - low)  # a margin for rounding
        if min(value - low, high - value) < margin and abs(value - p.nominal) > margin:
            return True
    return False
