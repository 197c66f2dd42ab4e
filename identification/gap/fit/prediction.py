"""What a fitted hypothesis predicts for every run, freed of what is no gap."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import trapezoid

from identification.gap.fit.fitter import LOST, Fitter, Point
from identification.gap.fit.variable_projection import Linear, freed, normal
from identification.gap.model.grey_box import GreyBox, weighted
from identification.report_2003.output_error import partial_error, relative_error, total_error

SETTLE = 3
"""Gauss-Newton steps for the numbers that every run has its own of, where a cause has such numbers."""


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """A model's answer to the inputs of every run."""

    outputs: list[NDArray]
    """Per run (channels, samples) [SI]: nominal starts and tolerances."""
    residuals: list[NDArray]
    """Per run (channels, samples): measured - model in noise deviations, 0 where readings do not count;
    tolerances as the fitted runs have them, each run with its own start."""
    as_recorded: list[NDArray]
    """The same, but every run begins as it was recorded: no start follows what the model lacks."""


def predict(fitter: Fitter, point: Point) -> Prediction:
    """Simulate all runs; held-out ones tell their own start and nothing else."""
    plant = fitter.plant
    local = point.local.copy()
    own = local.shape[1]
    for _ in range(SETTLE if own else 0):
        runs = _linear(fitter, point, local)[1]
        shared = normal([runs[r] for r in fitter.fitted]).shared
        local = local + np.array([freed(run, shared)[1][:own] for run in runs])
    outputs, runs = _linear(fitter, point, local)
    shared = normal([runs[r] for r in fitter.fitted]).shared
    shapes = [run.measured.shape for run in plant.runs]
    return Prediction(
        outputs=outputs,
        residuals=[
            freed(run, shared)[0].reshape(shape) for run, shape in zip(runs, shapes, strict=True)
        ],
        as_recorded=[
            (run.residual - run.shared @ shared).reshape(shape)
            for run, shape in zip(runs, shapes, strict=True)
        ],
    )


def percent(plant: GreyBox, outputs: list[NDArray]) -> Mapping[str, float] | None:
    """The report's error (eqs 19-21) on the held-out runs, by channel and 'overall' [%].

    A channel's is the root mean square over the runs of eq. 19, so that the channels' squares add up to
    the square of eq. 21. None where the time mean of a channel, by which eq. 19 divides, vanishes.
    """
    held_out = [(run, y) for run, y in zip(plant.runs, outputs, strict=True) if run.held_out]
    if any(_centred(run.measured, run.time) for run, _ in held_out):
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
    found = {c.name: float(total_error(list(errors[:, i]))) for i, c in enumerate(plant.channels)}
    overall = total_error([partial_error(list(run)) for run in errors])
    return {name: 100 * error for name, error in {**found, "overall": float(overall)}.items()}


def _centred(measured: NDArray, time: NDArray) -> bool:
    """Whether the time mean of a channel is as good as zero."""
    means = trapezoid(measured, time) / (time[-1] - time[0])
    return bool(np.any(np.abs(means) <= 1e-6 * np.max(np.abs(measured), axis=1)))


def _linear(fitter: Fitter, point: Point, local: NDArray) -> tuple[list[NDArray], list[Linear]]:
    """Outputs, and the runs linearised in their own numbers and the tolerances alone."""
    nuisances, frame = point.hypothesis.local, fitter.frame_of(point)
    n = 1 + len(nuisances)
    values = fitter.columns([point] * n)
    for j, nuisance in enumerate(nuisances):
        values[nuisance.symbol] = np.tile(nuisance.centre + local[:, j], (n, 1))
        values[nuisance.symbol][1 + j] += nuisance.step
    outputs = fitter.plant.outputs(values, fitter.everything)
    steps = np.array([nuisance.step for nuisance in nuisances])
    runs = []
    for r, output in enumerate(outputs):
        flat = weighted(fitter.plant, r, output).reshape(-1, n)
        starts = frame.starts[r]
        known = fitter.plant.starts[: starts.shape[1]]
        runs.append(
            Linear(
                residual=np.nan_to_num(fitter.target[r] - flat[:, 0], nan=LOST)
                + frame.shared[r] @ frame.at,
                slopes=np.zeros((len(flat), 0)),
                local=np.column_stack([np.nan_to_num(flat[:, 1:] - flat[:, :1]) / steps, starts]),
                local_value=np.concatenate([local[r], np.zeros(starts.shape[1])]),
                local_sd=np.array([nuisance.sd for nuisance in (*nuisances, *known)]),
                shared=frame.shared[r],
            )
        )
    return [output[..., 0] for output in outputs], runs
