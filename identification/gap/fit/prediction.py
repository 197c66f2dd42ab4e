"""What a fitted hypothesis predicts for every run, nuisance parameters accounted for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import Estimate, FittingProblem
from identification.gap.fit.gauss_newton import linearised_run
from identification.gap.fit.variable_projection import (
    LinearisedRun,
    normal_equations,
    without_run_nuisances,
)
from identification.gap.plant import GreyBox, noise_weighted
from identification.report_2003 import partial_error, relative_error, total_error


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
