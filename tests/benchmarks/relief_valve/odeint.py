"""The relief valve by Boost odeint: odeint.cpp, compiled where a compiler and Boost are installed."""

import shutil
import subprocess
from pathlib import Path

import numpy as np

from tests.benchmarks.relief_valve.model import (
    BETA,
    CONVERGED,
    DELTA,
    KAPPA,
    N_IMPACTS,
    RESTITUTION,
    START,
    Result,
    Task,
)

FLAGS = ("-std=c++17", "-O3", "-march=native")
SOURCE = Path(__file__).with_name("odeint.cpp")


class NoOdeintError(RuntimeError):
    """The program cannot be compiled here; the message says why."""


def build(folder: Path) -> Path:
    """Compile the program into a folder. Raises NoOdeintError where compiler or Boost is missing."""
    compiler = shutil.which("g++")
    if compiler is None:
        raise NoOdeintError("g++ is not installed")
    program = folder / "relief_valve_odeint"
    made = subprocess.run(
        [compiler, *FLAGS, str(SOURCE), "-o", str(program)], capture_output=True, text=True
    )
    if made.returncode and "boost/numeric/odeint.hpp" in made.stderr:
        raise NoOdeintError("Boost's headers are not installed (libboost-dev, or CPLUS_INCLUDE_PATH)")
    if made.returncode:
        raise RuntimeError(f"g++ does not compile {SOURCE.name}: {made.stderr[:2000]}")
    return program


def run_odeint(program: Path, task: Task, tolerance: float) -> tuple[Result, float]:
    """Do a task; tolerance: relative and absolute. Returns what it finds and its CPU time [s]."""
    given = (
        tolerance, task.transient, task.recorded, N_IMPACTS,
        KAPPA, BETA, DELTA, RESTITUTION, *START, CONVERGED, *task.flows,
    )  # fmt: skip
    arguments = [repr(float(value)) for value in given]
    printed = subprocess.run([program, *arguments], capture_output=True, text=True, check=True).stdout
    first, *lines = printed.splitlines()
    rows = np.array([[float(word) for word in line.split()] for line in lines])
    found = Result(
        passed=rows[:, 0], impacts=rows[:, 1 : 1 + N_IMPACTS], maxima=rows[:, 1 + N_IMPACTS :]
    )
    return found, float(first)
