"""Linearisation of estimates by finite differences, all candidates simulated side by side."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.hypothesis import Estimate, NuisanceSlopes
from identification.gap.fit.variable_projection import LinearisedRun
from identification.gap.model.grey_box import noise_weighted


def linearise(
    problem: FittingProblem, estimates: Sequence[Estimate], runs: Sequence[int]
) -> list[list[LinearisedRun]]:
    """Residuals and derivatives of each estimate in each of the runs."""
    changed = [_changed(problem, estimate) for estimate in estimates]
    ends = np.cumsum([0, *(len(each) for each in changed)])
    outputs = problem.outputs([candidate for each in changed for candidate in each], runs)
    return [
        [
            _linearised(problem, estimate, r, block[:, first:last])
            for r, block in zip(runs, outputs, strict=True)
        ]
        for estimate, first, last in zip(estimates, ends[:-1], ends[1:], strict=True)
    ]


def _changed(problem: FittingProblem, estimate: Estimate) -> list[Estimate]:
    """The estimate, then a copy for each parameter and run parameter, changed by its step."""
    candidates = [estimate]
    for i, step in enumerate(_steps(problem, estimate)):
        vector = estimate.vector.copy()
        vector[i] += step
        candidates.append(replace(estimate, vector=vector))
    for j, nuisance in enumerate(estimate.hypothesis.run_parameters):
        run_values = estimate.run_values.copy()
        run_values[:, j] += nuisance.step
        candidates.append(replace(estimate, run_values=run_values))
    return candidates


def _steps(problem: FittingProblem, estimate: Estimate) -> NDArray:
    """Finite differences of the scaled vector (k,) [1], away from the nearer end of each range."""
    settings = problem.settings
    middle = np.array([0.5 * (p.low + p.high) / p.scale for p in problem.parameters(estimate)])
    relative = np.where(estimate.vector > middle, -settings.difference_step, settings.difference_step)
    return relative * np.maximum(np.abs(estimate.vector), settings.smallest_differenced_value)


def _linearised(
    problem: FittingProblem, estimate: Estimate, run: int, outputs: NDArray
) -> LinearisedRun:
    """One run from the weighted outputs (values, 1 + k + l) of the changed estimates."""
    k = len(estimate.vector)
    changes = np.nan_to_num(outputs[:, 1:] - outputs[:, :1])
    return linearised_run(
        problem,
        estimate,
        run,
        outputs[:, 0],
        slopes=changes[:, :k] / _steps(problem, estimate),
        run_slopes=changes[:, k:] / [n.step for n in estimate.hypothesis.run_parameters],
        run_values=estimate.run_values[run],
    )


def linearised_run(
    problem: FittingProblem,
    estimate: Estimate,
    run: int,
    outputs: NDArray,
    *,
    slopes: NDArray,
    run_slopes: NDArray,
    run_values: NDArray,
) -> LinearisedRun:
    """One run from outputs and derivatives, with the nuisance slopes of the estimate.

    Args:
        problem: the readings.
        estimate: where the run is linearised.
        run: index of the run.
        outputs: weighted outputs, (values,) [noise deviations].
        slopes: their derivatives by the scaled vector, (values, k).
        run_slopes: their derivatives by the run parameters, (values, l).
        run_values: the run parameters less their centres, (l,) [SI].
    """
    nuisances = problem.slopes_of(estimate)
    offset_slopes, tolerance_slopes = nuisances.offset_slopes[run], nuisances.tolerance_slopes[run]
    offsets = offset_slopes.shape[1]
    run_parameters = estimate.hypothesis.run_parameters
    known = (*run_parameters, *problem.plant.run_offsets[:offsets])
    # The slopes describe tolerances from their centres: their part in the simulation is undone.
    undone = tolerance_slopes @ nuisances.deviations
    return LinearisedRun(
        residual=problem.residual(run, outputs[:, None])[:, 0] + undone,
        slopes=slopes,
        run_slopes=np.column_stack([run_slopes, offset_slopes]),
        run_values=np.concatenate([run_values, np.zeros(offsets)]),
        run_sd=np.array([nuisance.sd for nuisance in known]),
        tolerance_slopes=tolerance_slopes,
    )


def nuisance_slopes(
    problem: FittingProblem, estimates: Sequence[Estimate], deviations: Sequence[NDArray]
) -> list[NuisanceSlopes]:
    """Derivatives by run offsets and tolerances at each estimate, over all runs.

    Args:
        problem: the plant.
        estimates: where the derivatives are taken.
        deviations: tolerances of each estimate, (m,) [standard deviations from the centres].
    """
    plant = problem.plant
    nuisances = (*plant.run_offsets, *plant.tolerances)
    n, offsets = 1 + len(nuisances), len(plant.run_offsets)
    all_slopes = [
        NuisanceSlopes(deviations=d, offset_slopes=[], tolerance_slopes=[]) for d in deviations
    ]
    placed = [replace(e, slopes=slopes) for e, slopes in zip(estimates, all_slopes, strict=True)]
    values = problem.candidates([estimate for estimate in placed for _ in range(n)])
    for j, nuisance in enumerate(nuisances, start=1):
        centre = np.full(n * len(estimates), nuisance.centre, dtype=float)
        values.setdefault(nuisance.symbol, centre)[j::n] += nuisance.step
    steps = np.array([nuisance.step for nuisance in nuisances])
    sd = np.array([nuisance.sd for nuisance in plant.tolerances])
    for r, output in enumerate(plant.outputs(values, problem.all_runs)):
        outputs = noise_weighted(plant, r, output).reshape(-1, len(estimates), n)
        slopes = np.nan_to_num(outputs[..., 1:] - outputs[..., :1]) / steps
        for each, own in zip(all_slopes, slopes.transpose(1, 0, 2), strict=True):
            each.offset_slopes.append(own[:, :offsets])
            each.tolerance_slopes.append(own[:, offsets:] * sd)
    return all_slopes
