"""Rates of the environment at each of its interfaces, beside the kernel's, measured by turns.

python -m tests.benchmarks.environment [--quick] [--json PATH]
"""

import time
from statistics import median

import gymnasium
import numpy as np

from tests.benchmarks.command_line import run
from tests.benchmarks.environment_profile import profile
from tests.benchmarks.interfaces import IDENTIFIER, INTERFACES, rate
from tests.benchmarks.measure import Table


def benchmark(table: Table, quick: bool) -> None:
    """Every interface, one repetition after the other, so that a busy machine disturbs all alike."""
    repetitions, share = (3, 0.1) if quick else (15, 1.0)
    table.section(
        "control periods per second (one thread: of CPU time, else of wall time); ratio: to the kernel"
    )
    runs = {name: interface.begin(share) for name, interface in INTERFACES.items()}
    for one in runs.values():
        one()
    found: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repetitions):
        for name, one in runs.items():
            found[name].append(rate(name, one))
    for name, rates in found.items():
        kernel = INTERFACES[name].kernel
        ratio = median(rates) / median(found[kernel]) if kernel else None
        table.add(name, "1/s", rates, ratio=ratio)
    resets(table, repetitions)
    profile(table, repetitions)


def resets(table: Table, repetitions: int) -> None:
    """Time in which an episode begins."""
    table.section("the beginning of an episode")
    for n in (1, 256):
        env = gymnasium.make_vec(IDENTIFIER, num_envs=n, parameters="confidence")
        seconds = []
        for seed in range(repetitions + 1):
            start = time.perf_counter()
            env.reset(seed=seed)
            seconds.append((time.perf_counter() - start) / n)
        table.add(f"reset, {n} at a time, each", "us", list(1e6 * np.array(seconds[1:])))


if __name__ == "__main__":
    run(__doc__, benchmark)
