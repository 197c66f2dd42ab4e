"""Command lines that cannot work: each asks for an input that does not exist, and for more nonsense."""

import argparse
import contextlib
import importlib
import io
from pathlib import Path

import numpy as np

from epv_env.common.commands import commands
from training.console.command import COMMANDS, IDENTIFICATION

NEEDED: dict[str, list[str]] = {
    "train": ["--plant", "nowhere.json"],
    "compare": ["--tradeoff", "nowhere", "--cluster", "nowhere", "--scenarios", "flood"],
    "benchmark": ["--algo", "sac", "--env", "EPValve-v0"],
    "hard-scenarios": ["--scenarios", "flood"],
    "regret": ["--episodes", "0"],
    "sweep": ["--plant", "nowhere.json"],
    "tune": ["--only", "flood"],
    "tradeoff": ["--kinds", "flood"],
    "timing": ["--plant", "nowhere.json"],
    "bode": ["--plant", "nowhere.json"],
    "export": ["nowhere"],
    "export-fmu": ["policy", "nowhere"],
    "sim-to-real": ["--effect", "flood=1"],
    "bench": ["--effect", "flood=1"],
    "import": ["nowhere.mf4"],
    "blind": ["--trials", "0"],
    "run": ["nowhere"],
    "gap": ["nowhere"],
}
"""Arguments with which a command cannot work, whatever stands beside them."""

WORDS = (
    "--seed", "--workers", "--episodes", "--duration", "--timesteps", "--plant", "--rate", "--trials",
    "--starts", "--out", "--resume", "--force", "--quick", "--nonsense", "-1", "0", "nan", "inf",
    "1e999", "9" * 400, "", "x", "\udcff", "--", "=", "'", "/dev/null/x", "é", "-h1", "@file", "*",
)  # fmt: skip


def wrong_line(rng: np.random.Generator) -> tuple[str, list[str]]:
    """A command and arguments that it has to refuse."""
    name = list(NEEDED)[int(rng.integers(len(NEEDED)))]
    more = [WORDS[int(k)] for k in rng.integers(len(WORDS), size=int(rng.integers(0, 4)))]
    return name, [*more, *NEEDED[name], "--out", "fuzz-out"]


def status_of(name: str, arguments: list[str]) -> int:
    """Exit status of a command that is called in this process; its words are thrown away.

    Raises what the command raises beside ValueError, OSError and SystemExit.
    """
    entry = COMMANDS[name]
    own = [name, *arguments] if entry.module == IDENTIFICATION else arguments
    with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
        try:
            return importlib.import_module(entry.module).main(own)
        except (ValueError, OSError, argparse.ArgumentTypeError):
            return 2
        except SystemExit as end:
            return end.code if isinstance(end.code, int) else 1


def import_commands() -> None:
    """Import every command's module: that takes seconds, which no input is to blame for."""
    for entry in COMMANDS.values():
        importlib.import_module(entry.module)
    for module in commands(["identification.commands"]).values():
        importlib.import_module(module)


def left_files(folder: Path) -> list[str]:
    """Names of what a refused command left in its working folder."""
    return sorted(path.name for path in folder.rglob("*"))
