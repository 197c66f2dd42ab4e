"""Simulation of one run for several candidates: each in a loop of its own, or side by side in numpy."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.ode.delayed_inputs import delayed_mean, totals
from identification.gap.ode.records import compiled
from identification.gap.ode.stepping import Steps


@dataclass(frozen=True, kw_only=True)
class Job:
    """One run to be simulated for n candidates."""

    start: NDArray
    """States at the first sample, (states, n) [SI]."""
    inputs: NDArray
    """Samples of the inputs, held until the next one, (samples, inputs) [SI]."""
    delays: NDArray
    """By how much each input acts late, (inputs, n) [s]."""
    parameters: NDArray
    """Values of all symbols, (symbols, n) [SI]."""
    period: float
    """Sampling period [s]."""
    steps: int
    """Sub-steps in a sampling period."""
    acting: NDArray
    """First sample with the forcing, and the first one without it again, (2, n)."""
    push: NDArray
    """Forcing of the states' rates while it acts, (states, n) [SI/s]."""


def alone(steps: Steps, read: Callable, channels: int, compile_loop: bool) -> Callable:
    """A simulation in which each candidate has a loop of its own.

    Args:
        steps: functions that advance the plant.
        read: readings from states, as `Records.flat` makes it.
        channels: number of readings.
        compile_loop: whether numba compiles the loop.

    Returns:
        A function of a `Job` that gives readings (channels, samples, n) and states (states, samples, n).
    """
    advance = steps.advance
    wrap = compiled if compile_loop else _as_it_is
    mean = wrap(delayed_mean)

    @wrap
    def loop(x, inputs, total, delays, p, period, substeps, acting, push, states, readings):
        u, none = inputs[0].copy(), np.zeros_like(push)
        for k in range(len(inputs)):
            if not np.all(np.isfinite(x)):
                break
            for s in range(substeps):
                begin = k + s / substeps
                for i in range(len(u)):
                    if delays[i] == 0.0:
                        u[i] = inputs[k, i]
                    else:
                        u[i] = mean(total[:, i], begin - delays[i] / period, 1.0 / substeps)
                if s == 0:
                    states[:, k] = x
                    read(x, k * period, u, p, readings[:, k])
                pushed = push if acting[0] <= k < acting[1] else none
                x = advance(x, begin * period, period / substeps, u, p, pushed)

    def simulate(job: Job) -> tuple[NDArray, NDArray]:
        samples, n = len(job.inputs), job.start.shape[1]
        states = np.full((n, len(job.start), samples), np.nan)
        readings = np.full((n, channels, samples), np.nan)
        total = totals(job.inputs)
        for c in range(n):
            own = job.start[:, c].copy(), job.inputs, total, job.delays[:, c].copy()
            how = job.parameters[:, c].copy(), job.period, job.steps, job.acting[:, c].copy()
            try:
                loop(*own, *how, job.push[:, c].copy(), states[c], readings[c])
            except ArithmeticError:
                pass  # math.exp and others refuse what numpy calls inf: the candidate ends here
        return np.moveaxis(readings, 0, -1), np.moveaxis(states, 0, -1)

    return simulate


def together(steps: Steps, read: Callable, channels: int, thresholds: int) -> Callable:
    """A simulation of all candidates side by side; arguments and result are those of `alone`."""

    def simulate(job: Job) -> tuple[NDArray, NDArray]:
        samples, n = job.inputs.shape[0], job.start.shape[1]
        states, readings = np.empty((len(job.start), samples, n)), np.empty((channels, samples, n))
        x, p, size = job.start, job.parameters, job.period / job.steps
        total = totals(job.inputs) if np.any(job.delays) else None
        for k in range(samples):
            pushed = job.push * ((job.acting[0] <= k) & (k < job.acting[1]))
            for s in range(job.steps):
                begin = k + s / job.steps
                u = _inputs(job, total, k, begin)
                if s == 0:
                    states[:, k] = x
                    read(x, k * job.period, u, p, readings[:, k])
                x = _advanced(steps, thresholds, x, begin * job.period, size, u, p, pushed)
        readings[~np.isfinite(readings)] = np.nan
        return readings, states

    return simulate


def _inputs(job: Job, total: NDArray | None, k: int, begin: float) -> NDArray:
    """Inputs of a sub-step, (inputs, n)."""
    held = np.repeat(job.inputs[k][:, None], job.start.shape[1], axis=1)
    if total is not None:
        for i, c in np.argwhere(job.delays != 0.0):
            since = begin - job.delays[i, c] / job.period
            held[i, c] = delayed_mean(total[:, i], since, 1.0 / job.steps)
    return held


def _advanced(
    steps: Steps, thresholds: int, x: NDArray, t: float, h: float, u: NDArray, p: NDArray, push: NDArray
) -> NDArray:
    """All candidates after a sub-step (states, n); those at a threshold advance one by one."""
    end, stages = steps.runge_kutta(x, t, h, u, p, push)
    if thresholds:
        before = steps.levels(x, t, u, p)
        near = np.any(before * stages < 0.0, axis=(0, 1)) | np.any(before == 0.0, axis=0)
        for c in np.flatnonzero(near):
            end[:, c] = steps.advance(x[:, c], t, h, u[:, c], p[:, c], push[:, c])
    return end


def _as_it_is(function: Callable) -> Callable:
    return function
