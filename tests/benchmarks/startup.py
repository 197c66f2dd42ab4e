"""How long a fresh process takes to import the package and to make its first step."""

import subprocess
import sys

IMPORT = "import epv_env"
FIRST_STEP = """
from epv_env.plant.valves import Valves
valves = Valves(1)
valves.advance(5e-3)
"""


def seconds_in_fresh_processes(code: str, repetitions: int) -> list[float]:
    """Time that `code` takes in a new interpreter, without the interpreter's own start [s].

    One process before them fills the disk caches and is not counted.
    """
    timed = f"import time\nstart = time.perf_counter()\n{code}\nprint(time.perf_counter() - start)"
    found = []
    for _ in range(repetitions + 1):
        result = subprocess.run(
            [sys.executable, "-c", timed], capture_output=True, text=True, check=True
        )
        found.append(float(result.stdout.split()[-1]))
    return found[1:]
