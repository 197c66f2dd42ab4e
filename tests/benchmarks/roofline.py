"""Peak rates of this machine's arithmetic units, measured by small vectorised loops."""

from collections.abc import Callable

import numba
import numpy as np

from epv_env.plant.primitives import FLAGS
from tests.benchmarks.measure import durations, rates

VALUES = 256
"""Independent values in a loop."""
CHAINS, LENGTH = 8, 16
"""Independent chains of operations per value, and operations per chain."""


def _loop(operation: str) -> Callable:
    """Compiled loop of CHAINS independent chains of LENGTH operations over VALUES values."""
    lines = ["def loop(times, m, c, a):", "    for _ in range(times):"]
    lines += [f"        for lane in range({VALUES}):"]
    lines += [f"            x{i} = a[lane] + {i}.0" for i in range(CHAINS)]
    for _ in range(LENGTH):
        lines += [f"            x{i} = {operation.replace('x', f'x{i}')}" for i in range(CHAINS)]
    lines += ["            a[lane] = " + " + ".join(f"x{i}" for i in range(CHAINS))]
    namespace = {"sqrt": np.sqrt}
    exec("\n".join(lines), namespace)
    flags = {**FLAGS, "fastmath": FLAGS["fastmath"] - {"arcp"}}
    return numba.njit("void(int64, float64, float64, float64[::1])", **flags)(namespace["loop"])


def operation_rates(operation: str, repetitions: int) -> list[float]:
    """Operations per second on one thread; 'x * m + c' is one operation (and two flop)."""
    loop = _loop(operation)
    times = 1000 if "m +" in operation else 200
    seconds = durations(lambda: loop(times, 0.1, 0.9, np.ones(VALUES)), repetitions)
    return rates(times * VALUES * CHAINS * LENGTH, seconds)


def floating_point_rates(repetitions: int) -> list[float]:
    """Peak flop/s on one thread: fused multiply-add counts as two."""
    return [2 * rate for rate in operation_rates("x * m + c", repetitions)]
