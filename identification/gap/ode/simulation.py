"""Simulation of runs for several candidates, each candidate in a loop of its own."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.ode.delayed_inputs import delayed_mean, totals
from identification.gap.ode.stepping import workspace

Simulation = Callable[[Sequence["Job"]], list[tuple[NDArray, NDArray]]]
"""Gives of each job readings (channels, samples, n) and states (states, samples, n) [SI]; NaN from where
a candidate fails."""


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


def alone(advance: Callable, read: Callable, channels: int, wrap: Callable) -> Simulation:
    """A simulation in which each candidate has a loop of its own.

    Args:
        advance: of `advancing`.
        read: readings from states, as `Records.flat` makes it.
        channels: number of readings.
        wrap: compiles a function, or leaves it as it is.
    """
    mean = wrap(delayed_mean)

    @wrap
    def finite(x):
        total = 0.0
        for value in x:
            total += value
        return np.isfinite(total)

    @wrap
    def loop(x, inputs, total, delays, p, period, substeps, acting, push, work, states, readings):
        u, none = np.empty(inputs.shape[1]), np.zeros_like(push)
        for k in range(len(inputs)):
            if not finite(x):
                break
            pushed = push if acting[0] <= k < acting[1] else none
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
                advance(x, begin * period, period / substeps, u, p, pushed, work)

    def simulate(job: Job) -> tuple[NDArray, NDArray]:
        n, work = job.start.shape[1], workspace(len(job.start))
        states = np.full((n, len(job.start), len(job.inputs)), np.nan)
        readings = np.full((n, channels, len(job.inputs)), np.nan)
        total = totals(job.inputs)
        starts, delays, parameters, acting, pushes = (
            np.ascontiguousarray(own.T)
            for own in (job.start, job.delays, job.parameters, job.acting, job.push)
        )
        for c in range(n):
            given = starts[c], job.inputs, total, delays[c], parameters[c], job.period, job.steps
            # Functions such as math.exp refuse what numpy calls inf: the candidate ends there.
            with contextlib.suppress(ArithmeticError):
                loop(*given, acting[c], pushes[c], work, states[c], readings[c])
        return np.moveaxis(readings, 0, -1), np.moveaxis(states, 0, -1)

    return lambda jobs: [simulate(job) for job in jobs]
