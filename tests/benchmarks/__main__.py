"""Speed and memory of kernel, environments and identification beside their peers, in one run.

python -m tests.benchmarks [--quick]

Median, least..greatest of the repetitions. Single-threaded times are CPU times, which other processes
on the machine hardly touch. Machines are noisy all the same: trust the ratios.
"""

import argparse
import platform
import tempfile
from pathlib import Path
from statistics import median

import numba

from epv_env.plant.valves import available_cores
from tests.benchmarks.interfaces import INTERFACES, one_valve, rate, startup_seconds, used_by
from tests.benchmarks.relief_peers import NoOdeintError, build, run_odeint, run_scipy
from tests.benchmarks.relief_valve import Task, flows, run_lanes

BEGINNING = Task(flows=flows(8), transient=4, recorded=8)
"""Impacts and maxima of the relief valve before chaos has enlarged any difference."""

STEPS = {1e-6: 2e-2, 1e-8: 5e-3, 1e-10: 2e-3}
"""Step of this project's scheme by the tolerance at which odeint is no more accurate."""

HIGHEST_LASTING_FLOW = 8.5
"""Above 8.6 the oscillation dies out, and odeint's own errors keep it from coming to an end."""

PROCESSES = {
    "bench: the report's campaign": ("bench", "--out", "bench"),
    "run: the report's campaign": ("run", "bench", "--out", "run"),
}
"""Commands of the identification that are measured in processes of their own."""


def row(
    name: str, unit: str, values: list[float], *, ratio: float | None = None, note: str = ""
) -> None:
    """Print the median of a quantity and its spread; ratio: to the row that the part compares with."""
    spread = f"{min(values):.4g}..{max(values):.4g}" if len(values) > 1 else ""
    times = "" if ratio is None else f"x {ratio:.4g}"
    found = f"{median(values):>11.5g} {unit:<10} {spread:<22} {times:<11} {note}"
    print(f"  {name:<58} {found}".rstrip(), flush=True)


def environments(repetitions: int, share: float) -> None:
    """Every interface, one repetition after the other, so that a busy machine disturbs all alike."""
    print("\ncontrol periods per second; ratio: to the kernel with as many valves")
    runs = {name: interface.begin(share) for name, interface in INTERFACES.items()}
    for run in runs.values():
        run()
    found: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repetitions):
        for name, run in runs.items():
            found[name].append(rate(name, run))
    for name, rates in found.items():
        kernel = INTERFACES[name].kernel
        row(name, "1/s", rates, ratio=median(rates) / median(found[kernel]) if kernel else None)


def beside_scipy(repetitions: int, duration: float) -> None:
    """One valve under random switching by this plant and by LSODA with located events."""
    print("\none valve, simulated seconds per CPU second; ratio: to the first row")
    first = None
    for name, run in one_valve(duration).items():
        found = [run() for _ in range(repetitions)]
        first = first or median(speed for speed, _ in found)
        speeds = [speed for speed, _ in found]
        note = f"p2 wrong by {found[0][1]:.2g} Pa"
        row(name, "s per s", speeds, ratio=median(speeds) / first, note=note)


def relief_valve(repetitions: int, task: Task) -> None:
    """The public task with few flows; SciPy does its beginning only."""
    print(
        f"\nrelief valve, {task.flows.size} flows, {task.transient} + {task.recorded} maxima: maxima "
        "per CPU second, one thread;\nratio: to odeint with an error at least as large"
    )
    true = run_scipy(BEGINNING, "DOP853", 1e-13)[0]
    with tempfile.TemporaryDirectory() as folder:
        try:
            program = build(Path(folder))
        except NoOdeintError as missing:
            print(f"  no odeint: {missing}")
            program = None
        for tolerance, step in STEPS.items():
            own = [run_lanes(task, step) for _ in range(repetitions)]
            speeds = [found.passed.sum() / seconds for found, seconds in own]
            error = run_lanes(BEGINNING, step)[0].error(true)
            peer, ratio = [], None
            if program is not None:
                other = [run_odeint(program, task, tolerance) for _ in range(repetitions)]
                peer = [found.passed.sum() / seconds for found, seconds in other]
                ratio = median(speeds) / median(peer)
            row(f"this scheme, step {step:g}", "1/s", speeds, ratio=ratio, note=f"error {error:.1e}")
            if program is not None:
                worst = run_odeint(program, BEGINNING, tolerance)[0].error(true)
                row(f"odeint, tolerance {tolerance:g}", "1/s", peer, note=f"error {worst:.1e}")
    found, seconds = run_scipy(BEGINNING, "DOP853", 1e-10)
    note = f"error {found.error(true):.1e}"
    row("SciPy DOP853, tolerance 1e-10", "1/s", [found.passed.sum() / seconds], note=note)


def processes(repetitions: int) -> None:
    """Time and memory of fresh processes: start-up, and commands of the identification."""
    print("\nfresh processes, caches warm")
    for name, seconds in startup_seconds(repetitions).items():
        row(name, "s", seconds)
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in PROCESSES.items():
            seconds, peak = used_by(arguments, Path(folder))
            row(name, "s", [seconds], note=f"at most {peak:.0f} MiB")


def main() -> None:
    """Measure and print everything."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few repetitions, short runs")
    options = parser.parse_args()
    print(f"{platform.machine()}, {available_cores()} cores, numba {numba.__version__}")
    repetitions, share = (3, 0.1) if options.quick else (9, 1.0)
    task = Task(flows=flows(32, HIGHEST_LASTING_FLOW), transient=32 if options.quick else 1024)
    environments(repetitions, share)
    beside_scipy(repetitions, duration=2.0 * share)
    relief_valve(repetitions, task)
    processes(repetitions)


if __name__ == "__main__":
    main()
