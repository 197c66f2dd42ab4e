"""The integrators that the benchmark compares, by name."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from tests.benchmarks.measure import CPU
from tests.benchmarks.relief_valve.lanes import run_lanes
from tests.benchmarks.relief_valve.model import Result, Task
from tests.benchmarks.relief_valve.odeint import run_odeint
from tests.benchmarks.relief_valve.scipy_peer import run_scipy

Integrator = Callable[[Task], tuple[Result, float]]
"""Does a task. Returns what it finds and the CPU time [s]."""

STEPS = {1e-6: 2e-2, 1e-8: 5e-3, 1e-10: 2e-3}
"""Step of this project's scheme by the tolerance at which odeint is no more accurate."""

TOLERANCE = 1e-10
"""Relative and absolute tolerance of the public benchmark."""


def lanes(tolerance: float) -> str:
    """Name of this project's scheme with the step for a tolerance."""
    return f"this scheme, step {STEPS[tolerance]:g}"


def odeint(tolerance: float) -> str:
    """Name of odeint at a tolerance."""
    return f"odeint, Dormand-Prince 5, tolerance {tolerance:g}"


def lane_integrators() -> dict[str, Integrator]:
    """This project's scheme at each step, and with one trajectory at a time."""
    batches = {lanes(tol): _timed(partial(run_lanes, step=step)) for tol, step in STEPS.items()}
    alone = f"{lanes(TOLERANCE)}, one trajectory at a time"
    return batches | {alone: _timed(partial(_one_by_one, step=STEPS[TOLERANCE]))}


def odeint_integrators(program: Path) -> dict[str, Integrator]:
    """odeint at each tolerance; program: of `odeint.build`."""
    return {odeint(tol): partial(run_odeint, program, tolerance=tol) for tol in STEPS}


def scipy_integrators() -> dict[str, Integrator]:
    """`solve_ivp` at the public tolerance."""
    return {
        f"SciPy {method}, tolerance {TOLERANCE:g}": _timed(
            partial(run_scipy, method=method, tolerance=TOLERANCE)
        )
        for method in ("DOP853", "RK45")
    }


def _timed(function: Callable[[Task], Result]) -> Integrator:
    """An integrator that runs in this process."""

    def run(task: Task) -> tuple[Result, float]:
        begun = CPU()
        found = function(task)
        return found, CPU() - begun

    return run


def _one_by_one(task: Task, step: float) -> Result:
    """Each trajectory in a block of its own: fifteen of sixteen lanes rest."""
    parts = [
        run_lanes(Task(flows=np.array([q]), transient=task.transient, recorded=task.recorded), step)
        for q in task.flows
    ]
    return Result(
        impacts=np.vstack([part.impacts for part in parts]),
        maxima=np.vstack([part.maxima for part in parts]),
        passed=np.hstack([part.passed for part in parts]),
    )
