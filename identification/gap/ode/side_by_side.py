"""Simulation of all candidates side by side in numpy, and of runs with the same sampling period too."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.ode.delayed_inputs import delayed_means, totals
from identification.gap.ode.simulation import Job, Simulation
from identification.gap.ode.stepping import together_step, workspace


def together(
    rate: Callable, read: Callable, thresholds: Callable, counts: tuple[int, int], advance: Callable
) -> Simulation:
    """A simulation of all candidates at once; one that is near a threshold advances by itself.

    Args:
        rate: of the states, as `Records.flat` makes it.
        read: readings, as `Records.flat` makes them.
        thresholds: as `Records.flat` makes them.
        counts: numbers of readings and of thresholds.
        advance: of `advancing`, not compiled.
    """
    channels, count = counts

    def stepped(x: NDArray, t: float, h: float, u: NDArray, p: NDArray, push: NDArray) -> NDArray:
        end, stages = together_step(rate, x, t, h, u, p, push)
        if count:
            before, *after = (
                thresholds(y, t, u, p, np.empty((count, x.shape[1]))) for y in (x, *stages, end)
            )
            near = np.any(before == 0.0, axis=0) | np.any(before * np.array(after) < 0.0, axis=(0, 1))
            for c in np.flatnonzero(near):
                own = x[:, c].copy()
                advance(own, t, h, u[:, c], p[:, c], push[:, c], workspace(len(own)))
                end[:, c] = own
        return end

    def simulate(jobs: Sequence[Job]) -> list[tuple[NDArray, NDArray]]:
        bundle = _Bundle(jobs)
        x, p, size = bundle.start, bundle.parameters, bundle.period / bundle.steps
        states, readings = (np.empty((bundle.samples, rows, x.shape[1])) for rows in (len(x), channels))
        for k in range(bundle.samples):
            push = bundle.push * ((bundle.acting[0] <= k) & (k < bundle.acting[1]))
            for s in range(bundle.steps):
                begin = k + s / bundle.steps
                u = bundle.inputs(k, begin)
                if s == 0:
                    states[k] = x
                    read(x, k * bundle.period, u, p, readings[k])
                x = stepped(x, begin * bundle.period, size, u, p, push)
        readings[~np.isfinite(readings)] = np.nan
        return bundle.taken_apart(readings, states)

    def simulate_all(jobs: Sequence[Job]) -> list[tuple[NDArray, NDArray]]:
        alike: dict[tuple[float, int], list[int]] = {}
        for i, job in enumerate(jobs):
            alike.setdefault((job.period, job.steps), []).append(i)
        done = {}
        for members in alike.values():
            done |= dict(zip(members, simulate([jobs[i] for i in members]), strict=True))
        return [done[i] for i in range(len(jobs))]

    return simulate_all


class _Bundle:
    """Runs with the same sampling period as one simulation; the shorter ones are continued."""

    def __init__(self, jobs: Sequence[Job]):
        self.jobs, self.period, self.steps = jobs, jobs[0].period, jobs[0].steps
        self.start, self.parameters, self.delays, self.acting, self.push = (
            np.concatenate([getattr(job, name) for job in jobs], axis=1)
            for name in ("start", "parameters", "delays", "acting", "push")
        )
        self.samples = max(len(job.inputs) for job in jobs)
        self.signals = np.stack(
            [np.pad(j.inputs, ((0, self.samples - len(j.inputs)), (0, 0)), mode="edge") for j in jobs],
            axis=-1,
        )
        self.totals = totals(self.signals)
        self.run = np.repeat(np.arange(len(jobs)), [job.start.shape[1] for job in jobs])
        self.delayed = np.flatnonzero(np.any(self.delays, axis=1))

    def inputs(self, k: int, begin: float) -> NDArray:
        """Inputs of a sub-step that begins in the period k, at `begin` periods, (inputs, n)."""
        held = self.signals[k][:, self.run]
        for i in self.delayed:
            since = begin - self.delays[i] / self.period
            own = self.totals[:, i, self.run]
            held[i] = np.where(self.delays[i], delayed_means(own, since, 1.0 / self.steps), held[i])
        return held

    def taken_apart(self, readings: NDArray, states: NDArray) -> list[tuple[NDArray, NDArray]]:
        """Readings and states of each run, from (samples, channels or states, all candidates)."""
        parts = []
        for i, job in enumerate(self.jobs):
            own = (y[: len(job.inputs)][..., self.run == i] for y in (readings, states))
            read, passed = (np.swapaxes(y, 0, 1) for y in own)
            parts.append((read, passed))
        return parts
