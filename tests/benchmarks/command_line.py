"""Command line of the benchmarks: options, the machine, one table."""

import argparse
import json
import os
import platform
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
import scipy

from epv_env.plant.valves import available_cores
from tests.benchmarks.measure import Table
from tests.benchmarks.paired import compare

Benchmark = Callable[[Table, bool], None]
"""Measures into the table; True: few repetitions, short runs."""


def run(text: str | None, *benchmarks: Benchmark) -> None:
    """Measure and print everything. text: a program's docstring."""
    parser = argparse.ArgumentParser(description=text.splitlines()[0] if text else None)
    parser.add_argument("--quick", action="store_true", help="few repetitions, short runs")
    parser.add_argument(
        "--against",
        metavar="COMMIT",
        help="only pair the rates of all interfaces with those of this commit, run by turns",
    )
    parser.add_argument("--json", type=Path, metavar="PATH", help="also write the figures there")
    arguments = parser.parse_args()
    machine = this_machine()
    print(", ".join(f"{key} {value}" for key, value in machine.items()))
    print(
        "Median, least..greatest of the repetitions. Single-threaded times are CPU times, which other\n"
        "processes on the machine hardly touch; machines are noisy all the same: trust the ratios."
    )
    table = Table()
    if arguments.against:
        compare(table, arguments.against, arguments.quick)
    else:
        for benchmark in benchmarks:
            benchmark(table, arguments.quick)
    if arguments.json:
        found = {"machine": machine, "quick": arguments.quick, "results": table.as_dict()}
        arguments.json.write_text(json.dumps(found, indent=1))


def this_machine() -> dict[str, object]:
    """Processor, load and versions."""
    return {
        "processor": processor(),
        "cores": available_cores(),
        "load": f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown",
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "numba": numba.__version__,
    }


def processor() -> str:
    """Name of the processor, if the system gives one."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
