"""The relief valve by SciPy's `solve_ivp` with events, from impact to impact."""

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.benchmarks.relief_valve.model import (
    CONVERGED,
    DELTA,
    N_IMPACTS,
    RESTITUTION,
    START,
    Result,
    Task,
    rates,
)

SEGMENT = 4.0
"""`solve_ivp` is called for this long unless an impact ends it: it keeps all its steps in memory."""


@numba.njit
def _right_hand_side(_t, y, q):
    return np.array(rates(y[0], y[1], y[2], q))


def _impact(_t, y, _q):
    return y[0]


def _turn(_t, y, _q):
    return y[1]


_impact.terminal, _impact.direction = True, -1  # type: ignore[attr-defined]


class _Trajectory:
    """What one trajectory has met so far."""

    def __init__(self, task: Task, impacts: NDArray, maxima: NDArray):
        """impacts: (N_IMPACTS,) and maxima: (recorded,), both filled in."""
        self.passed, self.struck, self.last = 0, 0, np.nan
        self.complete = False
        self._task, self._impacts, self._maxima = task, impacts, maxima

    def turn(self, t: float, state: NDArray) -> None:
        """Take an extremum; state: (3,)."""
        x, _, p = state
        if t == 0.0 or self.complete:
            return
        if p < x + DELTA:  # the acceleration of a disc that does not move: a maximum
            at = self.passed - self._task.transient
            if at >= 0:
                self._maxima[at] = x
            self.passed += 1
            if abs(x - self.last) < CONVERGED:
                self._maxima[max(at, 0) :] = x
                self.complete = True
            self.complete |= at == self._task.recorded - 1
        self.last = x

    def strike(self, t: float, state: NDArray) -> NDArray:
        """Take an impact; state: (3,). Returns the state after it, (3,)."""
        if self.struck < N_IMPACTS:
            self._impacts[self.struck] = t
        self.struck += 1
        self.last = 0.0
        return np.array([0.0, -RESTITUTION * state[1], state[2]])


def _run(q: float, trajectory: _Trajectory, method: str, tolerance: float) -> None:
    """Integrate until the trajectory is complete."""
    t, state = 0.0, np.array(START)
    while not trajectory.complete:
        run = solve_ivp(
            _right_hand_side, (t, t + SEGMENT), state, method=method, rtol=tolerance, atol=tolerance,
            events=(_impact, _turn), args=(q,),
        )  # fmt: skip
        for at, turned in zip(run.t_events[1], run.y_events[1], strict=True):
            trajectory.turn(at, turned)
        t, state = run.t[-1], run.y[:, -1]
        if run.status == 1 and not trajectory.complete:
            state = trajectory.strike(t, state)


def run_scipy(task: Task, method: str, tolerance: float) -> Result:
    """Do a task by one of `solve_ivp`'s methods; tolerance: relative and absolute."""
    found = Result.empty(task)
    for k, q in enumerate(task.flows):
        trajectory = _Trajectory(task, found.impacts[k], found.maxima[k])
        _run(q, trajectory, method, tolerance)
        found.passed[k] = trajectory.passed
    return found
