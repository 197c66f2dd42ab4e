"""The exported C code, compiled and called from Python."""

import ctypes
import platform
import shlex
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from controllers.sensor_check import CHANNELS
from epv_env.observation import decode
from training.deploy.c_code import MEMORY
from training.deploy.translation import ExportError

STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror")
"""What the exported code is compiled with here."""

READINGS = (*CHANNELS, "coil")
"""Readings of a control unit at the end of a period, in the order of the C structure."""
READINGS_TYPE = np.dtype([*((name, "f4") for name in READINGS[:-1]), (READINGS[-1], "u1")], align=True)
"""The C structure, laid out as C lays it out."""


def compiler_words(command: str) -> list[str]:
    """The words of a compiler's command; none if there is no such program."""
    words = shlex.split(command)
    return words if words and shutil.which(words[0]) else []


def find_compiler(command: str) -> list[str]:
    """The words of a compiler's command. Raises ExportError if there is no such program."""
    words = compiler_words(command)
    if not words:
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
    """The policy as a library, loaded."""
    built = build(compiler, folder, "-shared", "-fPIC", "epv_policy.c", "-lm", output="policy.so")
    code = ctypes.CDLL(str(built))
    code.epv_policy_step.argtypes = (ctypes.c_void_p, ctypes.c_void_p)
    code.epv_policy_logits.argtypes = (ctypes.c_void_p, ctypes.c_void_p)
    code.epv_policy_logits.restype = None
    return code


def readings_of(observations: NDArray) -> dict[str, NDArray]:
    """The readings behind observations (n, entries), float32 (n,) in bar, A and 0 or 1, by READINGS."""
    wide = observations.astype(np.float64)
    entries = ("p1", "p2_error", "p3", "I", "target", "action")
    read = dict(zip(READINGS, (decode(wide, name) for name in entries), strict=True))
    read |= {"p2": read["p2"] + read["target"], "coil": np.rint(read["coil"])}
    return {name: values.astype(np.float32) for name, values in read.items()}


@dataclass(kw_only=True)
class CompiledPolicy:
    """The whole chain that runs in the unit, readings to action, behind the controllers' protocol.

    It makes readings of the observations, and observations of those again, with a memory of its own.
    """

    code: ctypes.CDLL
    environment: str = "EPValve-v0"
    name: str = "C"

    def reset(self, n: int) -> None:
        """n valves, nothing remembered."""
        self.memory = np.zeros(n, dtype=MEMORY)

    def act(self, observations: NDArray) -> NDArray:
        """Actions (n,) for the readings behind observations (n, entries)."""
        readings = np.zeros(len(observations), dtype=READINGS_TYPE)
        for name, values in readings_of(observations).items():
            readings[name] = values
        memory, reading = self.memory.ctypes.data, readings.ctypes.data
        memory_size, size = MEMORY.itemsize, READINGS_TYPE.itemsize
        step, n = self.code.epv_policy_step, len(readings)
        return np.array([step(memory + i * memory_size, reading + i * size) for i in range(n)])


def logits_of(code: ctypes.CDLL, inputs: NDArray) -> NDArray:
    """Logits (n, 2) of the compiled network for inputs (n, all)."""
    rows = np.ascontiguousarray(inputs, dtype=np.float32)
    logits = np.empty((len(rows), 2), dtype=np.float32)
    for row, result in zip(rows, logits, strict=True):
        code.epv_policy_logits(row.ctypes.data, result.ctypes.data)
    return logits


def machine(compiler: list[str]) -> dict[str, str]:
    """Processor, system and compiler of the code that was compared."""
    done = subprocess.run([*compiler, "--version"], capture_output=True, text=True, check=False)
    version = (done.stdout.splitlines() or ["unknown"])[0]
    return {"processor": platform.machine(), "system": platform.system(), "compiler": version}
