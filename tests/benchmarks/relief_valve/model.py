"""The pressure relief valve, without units, and the task of the benchmark.

Source: D. Nagy, L. Plavecz, F. Hegedus, arXiv 2011.01740, and github.com/nnagyd/ode_solver_tests:
x'' = -KAPPA x' - (x + DELTA) + p and p' = BETA (q - x sqrt(p)). At the seat, x = 0, the disc rebounds
with -RESTITUTION times its speed. q is the flow into the chamber.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.primitives import inlined

KAPPA, BETA, DELTA, RESTITUTION = 1.25, 20.0, 10.0, 0.8
START = (0.2, 0.0, 0.0)
"""Lift, speed and pressure at time 0."""

CONVERGED = 1e-9
"""A trajectory ends where a maximum of the lift is this close to the extremum before it."""

N_IMPACTS = 8
"""Impacts whose times are kept."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """What each integrator does: pass maxima of the lift, then keep the next ones."""

    flows: NDArray
    """q of each trajectory, (trajectories,)."""
    transient: int = 1024
    """Maxima that are passed, as in the public benchmark."""
    recorded: int = 32
    """Maxima that are kept, as in the public benchmark."""


@dataclass(frozen=True, kw_only=True)
class Result:
    """What a task finds; missing entries are NaN."""

    impacts: NDArray
    """Times of the first impacts, (trajectories, N_IMPACTS)."""
    maxima: NDArray
    """Maxima of the lift after the transient, (trajectories, recorded)."""
    passed: NDArray
    """Maxima passed and kept, (trajectories,)."""

    @classmethod
    def empty(cls, task: Task) -> "Result":
        """Nothing found yet."""
        n = task.flows.size
        return cls(
            impacts=np.full((n, N_IMPACTS), np.nan),
            maxima=np.full((n, task.recorded), np.nan),
            passed=np.zeros(n),
        )

    def error(self, true: "Result") -> float:
        """Greatest difference of impact times and maxima from those of `true`.

        Infinite where one of the two lacks an entry.
        """
        own, others = (np.hstack([found.impacts, found.maxima]) for found in (self, true))
        if (np.isnan(own) != np.isnan(others)).any():
            return float("inf")
        return float(np.nanmax(np.abs(own - others)))


def flows(count: int, highest: float = 10.0) -> NDArray:
    """Evenly spaced flows, (count,).

    The public benchmark begins at 0.2. There the first rebounds accumulate to infinitely many, which
    its programs leave to rounding. It ends at 10.
    """
    return np.linspace(0.3, highest, count)


@inlined
def rates(x, v, p, q):
    """Derivatives of lift, speed and pressure; q: flow."""
    return v, -KAPPA * v - (x + DELTA) + p, BETA * (q - x * sqrt(p))
