"""Arithmetic of one step of one valve, counted by running the kernel's source on counting numbers.

`python -m tests.benchmarks.operations` prints the counts as JSON. It must run with numba's compiler
switched off, so `count_operations` starts it as a process of its own.
"""

import json
import os
import subprocess
import sys
from collections import Counter
from types import SimpleNamespace

COUNTS: Counter[str] = Counter()


def _counting(name: str, kind: str):
    plain = getattr(float, name)

    def operation(self, *others):
        COUNTS[kind] += 1
        return Counted(plain(self, *others))

    return operation


def _comparing(name: str):
    plain = getattr(float, name)

    def comparison(self, other):
        COUNTS["compare"] += 1
        return plain(self, other)

    return comparison


class Counted(float):
    """A float that counts what is done to it; minimum and maximum count as comparisons."""

    __add__ = __radd__ = _counting("__add__", "add")
    __sub__ = _counting("__sub__", "add")
    __rsub__ = _counting("__rsub__", "add")
    __mul__ = __rmul__ = _counting("__mul__", "multiply")
    __truediv__ = _counting("__truediv__", "divide")
    __rtruediv__ = _counting("__rtruediv__", "divide")
    __lt__ = _comparing("__lt__")
    __le__ = _comparing("__le__")
    __gt__ = _comparing("__gt__")
    __ge__ = _comparing("__ge__")

    def __neg__(self):
        return Counted(float.__neg__(self))

    def __abs__(self):
        return Counted(float.__abs__(self))


def _square_root(value: float) -> Counted:
    COUNTS["square root"] += 1
    return Counted(value**0.5)


def main() -> None:
    """Count one pass of `try_steps` over a block of valves in the middle of an opening."""
    import numpy as np

    from epv_env.plant import lanes, primitives, runge_kutta, stepping
    from epv_env.plant.coefficients import coefficients
    from epv_env.plant.parameters import Parameters
    from epv_env.plant.simulate import energised

    primitives.math = SimpleNamespace(sqrt=_square_root)  # type: ignore[assignment]
    stepping.wide_vectors = lambda: None  # an instruction to the compiler, which is off
    p = Parameters.calibrated()
    work = np.zeros((lanes.N_ROW, lanes.LANES))
    moving = energised(p, p1=12e5, p2=7e5, U=24.0)._replace(p3=6e5, xPV=1e-3, xMV=2e-4)
    work[lanes.STATE : lanes.STATE + lanes.N_STATE] = np.array(moving)[:, None]
    c = coefficients(p)
    work[lanes.COEFFICIENT : lanes.COEFFICIENT + len(c)] = c
    work[lanes.REMAINING] = 5e-3
    work[lanes.HINT] = stepping.UNLIMITED
    counted = np.vectorize(Counted, otypes=[object])(work)
    COUNTS.clear()
    stepping.try_steps(counted, Counted(runge_kutta.DEFAULT_STEP), False)
    print(json.dumps({kind: number / lanes.LANES for kind, number in COUNTS.items()}))


def count_operations() -> dict[str, float]:
    """Operations per step of one valve, by kind, and their sum without comparisons as 'flop'."""
    result = subprocess.run(
        [sys.executable, "-m", "tests.benchmarks.operations"],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    counts = json.loads(result.stdout)
    counts["flop"] = sum(number for kind, number in counts.items() if kind != "compare")
    return counts


if __name__ == "__main__":
    main()
