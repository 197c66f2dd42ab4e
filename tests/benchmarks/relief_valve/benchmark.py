"""Accuracy and speed of the relief valve's integrators, in one run."""

import tempfile
from pathlib import Path
from statistics import median

import numpy as np

from tests.benchmarks.measure import Table, rates
from tests.benchmarks.relief_valve.integrators import (
    STEPS,
    TOLERANCE,
    Integrator,
    lane_integrators,
    lanes,
    odeint,
    odeint_integrators,
    scipy_integrators,
)
from tests.benchmarks.relief_valve.model import Task, flows
from tests.benchmarks.relief_valve.odeint import NoOdeintError, build
from tests.benchmarks.relief_valve.scipy_peer import run_scipy

BEGINNING = Task(flows=flows(8), transient=4, recorded=8)
"""Impacts and maxima before chaos has enlarged any difference."""

ATTRACTORS = Task(flows=np.array([2.0, 3.0, 4.0]), transient=56, recorded=8)
"""Points of the bifurcation diagram where the oscillation is periodic."""

REFERENCE = {"method": "DOP853", "tolerance": 1e-13}
"""SciPy as close to the truth as its tolerance goes."""

HIGHEST_LASTING_FLOW = 8.5
"""Above 8.6 the oscillation dies out, and odeint's own errors keep it from coming to an end."""

WORST_ERROR = 1e-3
"""An integrator farther from the reference solves another problem: the benchmark stops."""


def errors(integrators: dict[str, Integrator]) -> dict[str, str]:
    """What each integrator's greatest differences from the reference are, in words.

    Raises ValueError for an integrator that disagrees with the reference, and where this scheme is
    less accurate than odeint at the tolerance that it is paired with.
    """
    tasks = (BEGINNING, ATTRACTORS)
    true = [run_scipy(task, **REFERENCE) for task in tasks]
    found = {
        name: [run(task)[0].error(right) for task, right in zip(tasks, true, strict=True)]
        for name, run in integrators.items()
    }
    for name, values in found.items():
        if max(values) > WORST_ERROR:
            raise ValueError(f"{name} differs from the reference by {max(values):.2g}.")
    for tolerance in STEPS:
        own, other = found[lanes(tolerance)][0], found.get(odeint(tolerance), [np.inf])[0]
        if own > other:
            raise ValueError(f"{lanes(tolerance)} is off by {own:.2g}, odeint by {other:.2g}.")
    return {
        name: f"error {first:.1e} at the beginning, {second:.1e} on attractors"
        for name, (first, second) in found.items()
    }


def speeds(table: Table, integrators: dict[str, Integrator], task: Task, repetitions: int) -> None:
    """Maxima per CPU second of each integrator, by turns; this scheme against odeint as accurate."""
    notes = errors(integrators)
    whole = dict.fromkeys(integrators, task) | dict.fromkeys(scipy_integrators(), BEGINNING)
    found: dict[str, list[float]] = {name: [] for name in integrators}
    for _ in range(repetitions):
        for name, run in integrators.items():
            result, seconds = run(whole[name])
            found[name] += rates(float(result.passed.sum()), [seconds])
    peer = {lanes(tolerance): odeint(tolerance) for tolerance in STEPS}
    for name, values in found.items():
        other = found.get(peer.get(name, odeint(TOLERANCE)))
        ratio = median(values) / median(other) if other else None
        table.add(name, "1/s", values, ratio=ratio, note=notes[name])


def benchmark(table: Table, quick: bool) -> None:
    """The public task with few flows; SciPy does its beginning only."""
    repetitions, task = 5, Task(flows=flows(32, HIGHEST_LASTING_FLOW))
    if quick:
        repetitions, task = 3, Task(flows=flows(64), transient=32)
    table.section(
        f"relief valve, {task.flows.size} flows, {task.transient} + {task.recorded} maxima: maxima per "
        "CPU second, one thread;\nratio: to odeint with an error at least as large, else at the public "
        "tolerance"
    )
    with tempfile.TemporaryDirectory() as folder:
        try:
            peers = odeint_integrators(build(Path(folder)))
        except NoOdeintError as missing:
            print(f"  no odeint: {missing}")
            peers = {}
        speeds(table, lane_integrators() | peers | scipy_integrators(), task, repetitions)
