"""The relief valve by other integrators: SciPy's `solve_ivp`, from impact to impact, and Boost odeint.

relief_odeint.cpp is compiled where a compiler and Boost's headers are installed.
"""

import shutil
import subprocess
import time
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.benchmarks.relief_valve import (
    BETA,
    CONVERGED,
    DELTA,
    KAPPA,
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


def run_scipy(task: Task, method: str, tolerance: float) -> tuple[Result, float]:
    """Do a task by one of `solve_ivp`'s methods; tolerance: relative and absolute.

    Returns what it finds and the CPU time [s].
    """
    found, begun = Result.empty(task), time.process_time()
    for k, q in enumerate(task.flows):
        trajectory = _Trajectory(task, found.impacts[k], found.maxima[k])
        _run(q, trajectory, method, tolerance)
        found.passed[k] = trajectory.passed
    return found, time.process_time() - begun


COMPILER_FLAGS = ("-std=c++17", "-O3", "-march=native")
SOURCE = Path(__file__).with_name("relief_odeint.cpp")


class NoOdeintError(RuntimeError):
    """The program cannot be compiled here; the message says why."""


def build(folder: Path) -> Path:
    """Compile the program into a folder. Raises NoOdeintError where compiler or Boost is missing."""
    compiler = shutil.which("g++")
    if compiler is None:
        raise NoOdeintError("g++ is not installed")
    program = folder / "relief_valve_odeint"
    made = subprocess.run(
        [compiler, *COMPILER_FLAGS, str(SOURCE), "-o", str(program)], capture_output=True, text=True
    )
    if made.returncode and "boost/numeric/odeint.hpp" in made.stderr:
        raise NoOdeintError("Boost's headers are not installed (libboost-dev, or CPLUS_INCLUDE_PATH)")
    if made.returncode:
        raise RuntimeError(f"g++ does not compile {SOURCE.name}: {made.stderr[:2000]}")
    return program


def run_odeint(program: Path, task: Task, tolerance: float) -> tuple[Result, float]:
    """Do a task; tolerance: relative and absolute. Returns what it finds and its CPU time [s]."""
    given = (
        tolerance, task.transient, task.recorded, N_IMPACTS,
        KAPPA, BETA, DELTA, RESTITUTION, *START, CONVERGED, *task.flows,
    )  # fmt: skip
    arguments = [repr(float(value)) for value in given]
    printed = subprocess.run([program, *arguments], capture_output=True, text=True, check=True).stdout
    first, *lines = printed.splitlines()
    rows = np.array([[float(word) for word in line.split()] for line in lines])
    found = Result(
        passed=rows[:, 0], impacts=rows[:, 1 : 1 + N_IMPACTS], maxima=rows[:, 1 + N_IMPACTS :]
    )
    return found, float(first)
