"""Evidence: how well a refitted hypothesis explains the recordings, its form possibly inexact.

The true form of a cause never equals ours exactly. So a hypothesis may miss the recordings in every
short segment by a share of the cause's effect there. The recordings determine the share, up to a tenth;
a larger miss counts in full. The price of each fitted parameter is Laplace's (MacKay 1992).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.hypothesis import Estimate
from identification.gap.fit.linearisation import linearise
from identification.gap.fit.variable_projection import (
    LinearisedRun,
    NormalEquations,
    normal_equations,
    without_run_nuisances,
)
from identification.gap.rank.misfit import (
    cause_effects,
    form_error_misfits,
    generic_misfit_log_evidence,
)
from identification.gap.rank.settings import RankingSettings


@dataclass(frozen=True, kw_only=True)
class EvaluatedHypothesis:
    """A refitted hypothesis with its residuals and its evidence."""

    estimate: Estimate
    residuals: list[NDArray]
    """Per run (channels, samples) [noise deviations], nuisance parameters accounted for; 0 at untrusted
    readings."""
    log_evidence: float
    """With errors of form; natural logarithm, but for a constant of the recordings."""
    log_evidence_with_misfit: float
    """The same with a generic misfit instead of errors of form."""
    tolerances: NDArray
    """Tolerances that the fitted runs determine, (m,) [standard deviations from the centres]."""
    covariance: NDArray
    """Of calibrated parameters and parameters of causes, all else free, (k, k) [SI]."""
    at_bound: bool
    """Whether a parameter of a cause lies at a bound: the recordings ask for what cannot be."""

    @property
    def converged(self) -> bool:
        """Whether the fit has converged."""
        return self.estimate.converged

    @property
    def excess(self) -> float:
        """Sum of squares beyond that of noise [1]."""
        return sum(float(np.sum(r**2) - np.count_nonzero(r)) for r in self.residuals)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the causes."""
        return self.estimate.hypothesis.labels


def evaluate(
    problem: FittingProblem, estimates: Sequence[Estimate], settings: RankingSettings
) -> list[EvaluatedHypothesis]:
    """Evidence of each estimate on all runs.

    The vector has seen the fitted runs only; nuisance parameters, which have priors, adapt to every run.
    """
    if not estimates:
        return []
    linearised = linearise(problem, estimates, problem.all_runs)
    return [
        evaluate_linearised(problem, estimate, runs, settings)
        for estimate, runs in zip(estimates, linearised, strict=True)
    ]


def evaluate_linearised(
    problem: FittingProblem,
    estimate: Estimate,
    runs: Sequence[LinearisedRun],
    settings: RankingSettings,
) -> EvaluatedHypothesis:
    """Evidence of an estimate from all runs, linearised."""
    bound = problem.settings.largest_deviation
    tolerances = normal_equations(runs, bound).tolerances
    freed = [without_run_nuisances(run, tolerances, bound) for run in runs]
    misfits = np.sum(
        [
            form_error_misfits(problem.plant, r, residual, cause_effects(estimate, run), settings)
            for r, ((residual, _), run) in enumerate(zip(freed, runs, strict=True))
        ],
        axis=0,
    )
    residuals = [
        residual.reshape(run.measured.shape)
        for (residual, _), run in zip(freed, problem.plant.runs, strict=True)
    ]
    fitted = normal_equations([runs[r] for r in problem.fitted_runs], bound)
    covariance = _covariance(fitted, settings.smallest_eigenvalue)
    scales = [parameter.scale for parameter in problem.parameters(estimate)]
    deviations = _squared_deviations(runs, [step for _, step in freed], tolerances)
    price = _occam_price(estimate, np.sqrt(np.diag(covariance))) + 0.5 * deviations
    generic = generic_misfit_log_evidence(problem.plant, residuals, settings)
    return EvaluatedHypothesis(
        estimate=estimate,
        residuals=residuals,
        log_evidence=float(logsumexp(-0.5 * misfits) - np.log(len(misfits))) - price,
        log_evidence_with_misfit=generic - price,
        tolerances=fitted.tolerances,
        covariance=covariance * np.outer(scales, scales),
        at_bound=_at_bound(estimate, settings.bound_margin),
    )


def _squared_deviations(
    runs: Sequence[LinearisedRun], steps: Sequence[NDArray], tolerances: NDArray
) -> float:
    """Squared deviations of all nuisance parameters from their centres [1]."""
    return float(tolerances @ tolerances) + sum(
        float(np.sum(((run.run_values + step) / run.run_sd) ** 2))
        for run, step in zip(runs, steps, strict=True)
    )


def _covariance(equations: NormalEquations, smallest_eigenvalue: float) -> NDArray:
    """Covariance of the scaled vector (k, k) [1]; wide, but finite, where the recordings say nothing."""
    size = np.sqrt(np.diag(equations.hessian) + 1e-9)  # a parameter may have no effect at all
    values, vectors = np.linalg.eigh(equations.hessian / np.outer(size, size))
    return (vectors / np.maximum(values, smallest_eigenvalue)) @ vectors.T / np.outer(size, size)


def _occam_price(estimate: Estimate, sd: NDArray) -> float:
    """Log of each cause parameter's range over the part that the data leave (Laplace), never negative.

    sd: standard deviations of the scaled vector, (k,) [1].
    """
    parameters = estimate.hypothesis.parameters
    widths = np.array([abs(p.high - p.low) / p.scale for p in parameters])
    left = np.minimum(np.sqrt(2 * np.pi) * sd[len(sd) - len(parameters) :], widths)
    return float(np.sum(np.log(widths / left)))


def _at_bound(estimate: Estimate, margin_share: float) -> bool:
    """Whether a cause's parameter lies at an end of its range and is not merely nominal there."""
    for p, scaled in zip(estimate.hypothesis.parameters, estimate.cause_vector, strict=True):
        low, high = sorted((p.low, p.high))
        value, margin = scaled * p.scale, margin_share * (high - low)
        if min(value - low, high - value) < margin and abs(value - p.nominal) > margin:
            return True
    return False
