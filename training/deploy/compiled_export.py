"""The exported C code, compiled: called from Python, and run as a stranger runs it."""

import ctypes
import shlex
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.observation import HISTORY
from training.deploy.c_variants import VARIANTS
from training.deploy.quantisation import ExportError
from training.deploy.visited_states import READINGS, readings_of

STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror")
"""What the exported code is compiled with here."""
VARIANT_NAMES = tuple(variant.name for variant in VARIANTS)
CODE = tuple(f"epv_{name}.c" for name in VARIANT_NAMES)
"""Files that hold the policy."""

PER_UNIT = {"current": 1e6, "coil": 1.0}
"""Whole numbers to one A, and to the coil's 1; 10^5 Pa to one bar."""
NUMBER = {"float": "f4", "fixed": "i4"}
READINGS_TYPE = {
    variant: np.dtype([*((name, number) for name in READINGS[:-1]), (READINGS[-1], "u1")], align=True)
    for variant, number in NUMBER.items()
}
"""The C structure, laid out as C lays it out."""


def memory_type(variant: str, cells: int) -> np.dtype:
    """The C structure of a variant's memory, for a policy with so many cells or with none."""
    number = NUMBER[variant]
    return np.dtype(
        [("p2", number, HISTORY), ("p3", number, HISTORY), ("cell", number, cells), ("waited", "u2"),
         ("newest", "u1"), ("coil", "u1"), ("begun", "u1")],
        align=True,
    )  # fmt: skip


def find_compiler(command: str) -> list[str]:
    """The words of a compiler's command. Raises ExportError if there is no such program."""
    words = shlex.split(command)
    if not words or shutil.which(words[0]) is None:
        raise ExportError(
            f"there is no C compiler {command!r} here, and no export goes out that was not compiled and "
            "compared: install one (Debian: apt install gcc), or name yours with --compiler"
        )
    return words


def build(compiler: list[str], folder: Path, *options: str, output: str) -> Path:
    """Compile files of a folder strictly. Raises ExportError with the compiler's first complaint."""
    done = subprocess.run(
        [*compiler, *STRICT, *options, "-o", output],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        complaint = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr)
        raise ExportError(f"{compiler[0]} does not compile the exported code: {complaint.strip()}")
    return folder / output


def library(compiler: list[str], folder: Path) -> ctypes.CDLL:
    """Both variants as one library, loaded."""
    return ctypes.CDLL(str(build(compiler, folder, "-shared", "-fPIC", *CODE, output="policy.so")))


@dataclass(kw_only=True)
class CompiledPolicy:
    """The whole chain that runs in the unit, readings to action, behind the controllers' protocol.

    It makes readings of the observations, and observations of those again, with a memory of its own.
    """

    code: ctypes.CDLL
    variant: str
    """One of VARIANT_NAMES."""
    cells: int
    """Of the policy: its memory's size depends on them."""
    environment: str = "EPValve-v0"
    name: str = field(init=False)

    def __post_init__(self) -> None:
        self.name = f"{self.variant} C"
        self._step = getattr(self.code, f"epv_{self.variant}_step")
        self._step.argtypes = (ctypes.c_void_p, ctypes.c_void_p)

    def reset(self, n: int) -> None:
        """n valves, nothing remembered."""
        self._memory = np.zeros(n, dtype=memory_type(self.variant, self.cells))

    def act(self, observations: NDArray) -> NDArray:
        """Actions (n,) for the readings behind observations (n, entries)."""
        readings = as_structures(readings_of(observations), self.variant)
        memory, reading = self._memory.ctypes.data, readings.ctypes.data
        memory_size, size = self._memory.itemsize, readings.itemsize
        return np.array(
            [self._step(memory + i * memory_size, reading + i * size) for i in range(len(readings))]
        )


def as_structures(readings: dict[str, NDArray], variant: str) -> NDArray:
    """Readings (n,) in bar and A as an array of C structures; whole numbers as states.h makes them."""
    structures = np.zeros(len(readings["coil"]), dtype=READINGS_TYPE[variant])
    for name, values in readings.items():
        if variant == "fixed":
            wide = values.astype(np.float64) * PER_UNIT.get(name, 1e5)
            values = np.trunc(wide + np.copysign(0.5, wide))
        structures[name] = values
    return structures


def float_logits(code: ctypes.CDLL, observations: NDArray, *, cells: int) -> NDArray:
    """Logits (episodes, periods, 2) of the float code along observations (episodes, periods, entries).

    cells: of the policy.
    """
    inputs = np.ascontiguousarray(observations, dtype=np.float32)
    logits = np.empty((*inputs.shape[:2], 2), dtype=np.float32)
    function: Any = code.epv_float_logits
    function.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
    function.restype = None
    for episode in range(len(inputs)):
        memory = np.zeros(1, dtype=memory_type("float", cells))
        for k in range(inputs.shape[1]):
            function(memory.ctypes.data, inputs[episode, k].ctypes.data, logits[episode, k].ctypes.data)
    return logits
