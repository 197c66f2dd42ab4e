"""What a fitted hypothesis predicts for every run, and what it leaves of the recordings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import Estimate, FittingProblem
from identification.gap.fit.gauss_newton import linearise, linearised_run
from identification.gap.fit.variable_projection import (
    LinearisedRun,
    NormalEquations,
    normal_equations,
    without_run_nuisances,
)
from identification.gap.plant import GreyBox, noise_weighted
from identification.gap.prepare.noise import ChannelNoise
from identification.report_2003 import partial_error, relative_error, total_error


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
        return self.estimate.hypothesis.titles

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


def variance_inflation(each: EvaluatedHypothesis, noise: Sequence[ChannelNoise]) -> float:
    """Variance of a parameter relative to that under white noise of the channels' size [1], at least 1.

    Noise and discrepancy together count, and readings that are correlated tell less.
    """
    correlations = np.array([own.correlated for own in noise])
    readings = sum(own.readings for own in noise)
    return max(float(np.sum(correlations * each.squares)) / max(readings, 1), 1.0)


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """A model's response to the inputs of every run."""

    outputs: list[NDArray]
    """Per run (channels, samples) [SI], with nominal run offsets and tolerances."""
    residuals: list[NDArray]
    """Per run (channels, samples) [noise deviations]: measured - model, 0 at untrusted readings.
    Tolerances come from the fitted runs, run offsets from each run."""
    residuals_nominal_offsets: list[NDArray]
    """The same, (channels, samples) [noise deviations], with nominal run offsets: no offset can follow
    what the model lacks."""


def predict(problem: FittingProblem, estimate: Estimate) -> Prediction:
    """Simulate all runs; a held-out run determines its own nuisance parameters and nothing else."""
    estimate = with_settled_runs(problem, estimate)
    outputs, runs = _in_run_parameters(problem, estimate)
    shared = _shared(problem, runs)
    shapes = [run.measured.shape for run in problem.plant.runs]
    return Prediction(
        outputs=outputs,
        residuals=[
            without_run_nuisances(run, shared)[0].reshape(shape)
            for run, shape in zip(runs, shapes, strict=True)
        ],
        residuals_nominal_offsets=[
            (run.residual - run.shared_slopes @ shared).reshape(shape)
            for run, shape in zip(runs, shapes, strict=True)
        ],
    )


def with_settled_runs(problem: FittingProblem, estimate: Estimate) -> Estimate:
    """The estimate whose run parameters suit every run, held-out ones too, all else as it is.

    The outputs need not be linear in them, as with a winding that begins 30 K warmer, but nearly so:
    three Gauss-Newton steps suffice.
    """
    count = len(estimate.hypothesis.run_parameters)
    for _ in range(3 if count else 0):
        runs = _in_run_parameters(problem, estimate)[1]
        shared = _shared(problem, runs)
        steps = [without_run_nuisances(run, shared)[1][:count] for run in runs]
        estimate = replace(estimate, run_values=estimate.run_values + np.array(steps))
    return estimate


def _shared(problem: FittingProblem, runs: Sequence[LinearisedRun]) -> NDArray:
    """Shared nuisances (m,) [standard deviations] as the fitted runs determine them."""
    fitted = [runs[r] for r in problem.fitted_runs]
    return normal_equations(fitted).shared


def _in_run_parameters(
    problem: FittingProblem, estimate: Estimate
) -> tuple[list[NDArray], list[LinearisedRun]]:
    """Outputs, per run (channels, samples) [SI], and the runs linearised in their nuisances alone."""
    nuisances = estimate.hypothesis.run_parameters
    n = 1 + len(nuisances)
    values = problem.candidates([estimate] * n)
    for j, nuisance in enumerate(nuisances):
        values[nuisance.symbol] = np.tile(nuisance.centre + estimate.run_values[:, j], (n, 1))
        values[nuisance.symbol][1 + j] += nuisance.step
    steps = np.array([nuisance.step for nuisance in nuisances])
    outputs = problem.plant.outputs(values, problem.all_runs)
    runs = []
    for r, output in enumerate(outputs):
        flat = noise_weighted(problem.plant, r, output).reshape(-1, n)
        runs.append(
            linearised_run(
                problem,
                estimate,
                r,
                flat[:, 0],
                slopes=np.zeros((len(flat), 0)),
                run_slopes=np.nan_to_num(flat[:, 1:] - flat[:, :1]) / steps,
                run_values=estimate.run_values[r],
            )
        )
    return [output[..., 0] for output in outputs], runs


def percentage_errors(plant: GreyBox, outputs: Sequence[NDArray]) -> Mapping[str, float] | None:
    """The 2003 report's output error (eqs 19-21) on the held-out runs.

    A channel's error is the root mean square of eq. 19 over the runs, so that the squares of the
    channels add up to the square of eq. 21.

    Args:
        plant: the plant with its readings.
        outputs: model outputs, per run (channels, samples) [SI].

    Returns:
        Errors by channel and 'overall' [%]; None where a channel changes its sign or stays at 0: eq. 19
        divides by its time mean, which then says nothing of its size.
    """
    held_out = [(run, y) for run, y in zip(plant.runs, outputs, strict=True) if run.held_out]
    for run, _ in held_out:
        for channel, readings in zip(plant.channels, run.measured, strict=True):
            # All on one side of 0, and their mean off 0, but for noise.
            up, down = np.mean(np.maximum(readings, 0.0)), np.mean(np.maximum(-readings, 0.0))
            if not min(up, down) <= (channel.noise or 0.0) < abs(up - down):
                return None
    errors = np.array(
        [
            [
                relative_error(measured, model, run.time)
                for measured, model in zip(run.measured, y, strict=True)
            ]
            for run, y in held_out
        ]
    )
    by_channel = {
        channel.name: float(total_error(list(errors[:, i]))) for i, channel in enumerate(plant.channels)
    }
    overall = total_error([partial_error(list(run)) for run in errors])
    return {name: 100 * error for name, error in {**by_channel, "overall": float(overall)}.items()}
