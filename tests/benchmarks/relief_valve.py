"""The relief valve of a public benchmark, integrated as the plant is.

Source: D. Nagy, L. Plavecz, F. Hegedus, arXiv 2011.01740, and github.com/nnagyd/ode_solver_tests:
x'' = -KAPPA x' - (x + DELTA) + p and p' = BETA (q - x sqrt(p)), without units. At the seat, x = 0, the
disc rebounds with -RESTITUTION times its speed. q is the flow into the chamber.

The plant's kernel is compiled for the states of its valve. Here the same scheme drives three states:
one trial step for all sixteen lanes, no step beyond the seat, an impact located on the step's cubic by
the plant's own functions, the step taken again up to the impact.
"""

import time
from dataclasses import dataclass
from math import sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from epv_env.plant.lanes import LANES
from epv_env.plant.primitives import FLAGS, inlined
from epv_env.plant.stepping import crossing, hermite, turning_point

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


LANDING = 1e-12
"""A disc closer than this to the seat has landed."""

SHORTEST_STEP = 1e-14
"""A step up to an impact lasts at least this long: no disc here flies a landing's width meanwhile."""

GROWTH = 0.05
"""Longest step in terms of the time: at the start the root of the pressure has no derivative."""

FIRST_STEP = 1e-8
"""Added to that limit, so that there is a first step."""

MOST_STEPS = 10_000_000
"""Steps after which a block is given up: what it has not found stays NaN."""

_UNLOCATED = 1e9  # a step hint that never binds

X, V, P, Q, TIME, HINT, RUNNING = range(7)
X1, V1, P1, H, MET = range(7, 12)  # the trial step, and 1 where it met anything
LAST, PASSED, IMPACTS = range(12, 15)  # last extremum, maxima and impacts so far
N_ROW = 15


@inlined
def _runge_kutta(x, v, p, q, h):
    """Lift, speed and pressure after one classical step."""
    half, sixth = 0.5 * h, h / 6.0
    ax, av, ap = rates(x, v, p, q)
    bx, bv, bp = rates(x + half * ax, v + half * av, p + half * ap, q)
    cx, cv, cp = rates(x + half * bx, v + half * bv, p + half * bp, q)
    dx, dv, dp = rates(x + h * cx, v + h * cv, p + h * cp, q)
    return (
        x + sixth * (ax + 2.0 * (bx + cx) + dx),
        v + sixth * (av + 2.0 * (bv + cv) + dv),
        p + sixth * (ap + 2.0 * (bp + cp) + dp),
    )


@inlined
def begin(work, lane, q, running):
    """Begin a trajectory with the flow q in a lane, unless running is 0."""
    for row in range(N_ROW):
        work[row, lane] = 0.0
    work[X, lane], work[V, lane], work[P, lane] = START
    work[Q, lane], work[RUNNING, lane], work[HINT, lane] = q, running, _UNLOCATED


def stepper(lanes):
    """`try_steps` of a block of so many lanes: LLVM has to know their number."""

    @inlined
    def try_steps(work, step):
        """Take one trial step in every lane; accept it where the disc neither turns nor meets the seat.

        Returns whether it does in any lane.
        """
        met = False
        for lane in range(lanes):
            x, v, p, time = work[X, lane], work[V, lane], work[P, lane], work[TIME, lane]
            h = min(min(step, GROWTH * time + FIRST_STEP), work[HINT, lane]) * work[RUNNING, lane]
            x1, v1, p1 = _runge_kutta(x, v, p, work[Q, lane], h)
            meets = (v * v1 < 0.0) | (x1 < -LANDING) | ((x1 <= LANDING) & (v1 < 0.0))
            work[X, lane] = x if meets else x1
            work[V, lane] = v if meets else v1
            work[P, lane] = p if meets else p1
            work[TIME, lane] = time if meets else time + h
            work[HINT, lane] = _UNLOCATED
            work[X1, lane], work[V1, lane], work[P1, lane], work[H, lane] = x1, v1, p1, h
            work[MET, lane] = 1.0 if meets else 0.0
            met |= meets
        return met

    return try_steps


_try_steps = stepper(LANES)


@numba.njit(**FLAGS)
def settle(work, lane, transient, impacts, maxima):
    """Shorten a step that passes the seat; accept any other with its extremum and its impact."""
    x, v, h = work[X, lane], work[V, lane], work[H, lane]
    x1, v1 = work[X1, lane], work[V1, lane]
    turn = turning_point(v, v1)
    extremum = hermite(x, v, x1, v1, h, turn)
    if min(extremum, x1) < -LANDING:
        until = turn if extremum < 0.0 else 1.0
        fraction = crossing(x, v, x1, v1, h, 0.0, until)
        # A disc that ends closer to the seat than bisections resolve needs Newton's step instead.
        located = fraction * h if fraction < 1.0 else h - x1 / v1
        work[HINT, lane] = max(located, SHORTEST_STEP)
        return
    work[X, lane], work[V, lane], work[P, lane] = x1, v1, work[P1, lane]
    work[TIME, lane] += h
    if v > 0.0 and v1 < 0.0:
        _keep_maximum(work, lane, extremum, transient, maxima)
    if v * v1 < 0.0:
        work[LAST, lane] = extremum
    if x1 <= LANDING and v1 < 0.0:
        work[X, lane], work[V, lane] = 0.0, -RESTITUTION * v1
        work[LAST, lane] = 0.0
        count = int(work[IMPACTS, lane])
        if count < N_IMPACTS:
            impacts[count] = work[TIME, lane]
        work[IMPACTS, lane] += 1.0


@numba.njit(**FLAGS)
def _keep_maximum(work, lane, value, transient, maxima):
    """Count a maximum, keep it after the transient; end a trajectory that is complete or at rest."""
    at = int(work[PASSED, lane]) - transient
    if at >= 0:
        maxima[at] = value
    work[PASSED, lane] += 1.0
    if abs(value - work[LAST, lane]) < CONVERGED:
        for later in range(max(at, 0), maxima.size):
            maxima[later] = value
        work[RUNNING, lane] = 0.0
    if at == maxima.size - 1:
        work[RUNNING, lane] = 0.0


@numba.njit(**FLAGS)
def _run(q, step, transient, impacts, maxima, passed):
    """All trajectories, block by block."""
    work = np.empty((N_ROW, LANES))
    for first in range(0, q.size, LANES):
        for lane in range(LANES):
            own = first + lane
            begin(work, lane, q[min(own, q.size - 1)], 1.0 if own < q.size else 0.0)
        for _ in range(MOST_STEPS):
            if _try_steps(work, step):
                for lane in range(LANES):
                    if work[MET, lane] != 0.0:
                        own = first + lane
                        settle(work, lane, transient, impacts[own], maxima[own])
                if work[RUNNING].sum() == 0.0:
                    break
        for own in range(first, min(first + LANES, q.size)):
            passed[own] = work[PASSED, own - first]


def run_lanes(task: Task, step: float) -> tuple[Result, float]:
    """Do a task with steps of at most `step`. Returns what it finds and the CPU time [s]."""
    found = Result.empty(task)
    begun = time.process_time()
    _run(task.flows, step, task.transient, found.impacts, found.maxima, found.passed)
    return found, time.process_time() - begun
