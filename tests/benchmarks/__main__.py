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
from tests.benchmarks.interfaces import INTERFACES, rate, used_by

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


def processes() -> None:
    """Time and memory of commands of the identification in fresh processes."""
    print("\nfresh processes, caches warm")
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
    environments(repetitions, share)
    processes()


if __name__ == "__main__":
    main()
