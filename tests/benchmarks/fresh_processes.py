"""Time and memory of a command of the identification in a fresh process."""

import json
import subprocess
import sys
from dataclasses import dataclass

LAUNCHER = """
import json, resource, subprocess, sys, time
start = time.perf_counter()
done = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
seconds = time.perf_counter() - start
if done.returncode:
    sys.exit(done.stderr)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
cpu, peak = used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
print(json.dumps({"seconds": seconds, "cpu": cpu, "peak": peak}))
"""
"""Starts the command. A process inherits the peak memory of its parent, so the parent is small."""


@dataclass(frozen=True, kw_only=True)
class Process:
    """Time and memory of a process."""

    seconds: float
    """Wall time [s]."""
    cpu: float
    """Time that the cores spent on it, its children included [s]."""
    peak: float
    """Memory of the process, or of a child if that had more [MiB]."""

    @property
    def note(self) -> str:
        """CPU time, which other processes on the machine disturb less."""
        return f"{self.cpu:.3g} s on the cores"


def identification_process(*arguments: object) -> Process:
    """`python -m identification` with the arguments. Raises RuntimeError if it fails."""
    command = [sys.executable, "-m", "identification", *map(str, arguments)]
    result = subprocess.run(
        [sys.executable, "-c", LAUNCHER, *command], capture_output=True, text=True, check=False
    )
    if result.returncode:
        raise RuntimeError(f"{' '.join(command)} failed:\n{result.stderr}")
    return Process(**json.loads(result.stdout))
