"""What the tests of the export share: a policy of random weights, exports, and what they hold."""

import re
import shutil
import subprocess
from itertools import pairwise
from pathlib import Path

import numpy as np

from controllers.hysteresis import Hysteresis
from controllers.policy_files import Network, write_policy
from epv_env.common.commands import main_of
from training.deploy.agreement import STATES_EPISODES as EPISODES
from training.deploy.agreement import STATES_PERIODS as PERIODS
from training.deploy.c_code import INPUTS

GOOD = Hysteresis(open_below=-0.1, shut_above=0.0, shut_lookahead=0.03, name="good")
QUICK = ("--episodes", "4", "--duration", "1")


def random_policy(folder: Path, *, seed: int = 0, widths: tuple[int, ...] = (24, 40, 8)) -> Path:
    """A policy whose weights mean nothing, written as training writes it; returns the folder."""
    rng = np.random.default_rng(seed)
    layers = [
        (
            rng.normal(scale=1.5 / np.sqrt(before), size=(after, before)).astype(np.float32),
            rng.normal(scale=0.3, size=after).astype(np.float32),
        )
        for before, after in pairwise([INPUTS, *widths, 2])
    ]
    network = Network(layers=layers, advice_weight=rng.normal(size=2).astype(np.float32))
    write_policy(network, folder, control_period=5e-3, provenance={"seed": seed})
    return folder


def command(*words: object) -> int:
    arguments = [str(word) for word in words]
    return main_of("training.commands.export", program="export", arguments=arguments)


def export(policy: Path, out: Path, *more: str) -> int:
    return command(policy, "--out", out, *QUICK, *more)


def column(folder: Path, name: str) -> np.ndarray:
    """One of states.csv, (episodes, periods)."""
    table = np.genfromtxt(folder / "states.csv", delimiter=",", names=True)
    return table[name].reshape(EPISODES, PERIODS)


def inputs(folder: Path) -> np.ndarray:
    """Inputs (states, entries) of the network in states.csv, as float32."""
    table = np.genfromtxt(folder / "states.csv", delimiter=",", skip_header=1)
    return table[:, 7 : 7 + INPUTS].astype(np.float32)


def parity(folder: Path, *options: str) -> subprocess.CompletedProcess:
    """Do what the comment of parity.c says, as a stranger would."""
    line = re.search(r"cc .* && \./parity", (folder / "parity.c").read_text())
    assert line is not None
    command = line.group().replace("-O2", " ".join(["-O2", *options]))
    return subprocess.run(command, shell=True, cwd=folder, capture_output=True, text=True, check=False)


def parity_with(folder: Path, file: str, pattern: str, instead: str) -> int:
    """The exit status of parity after something in a file was replaced."""
    text, count = re.subn(pattern, instead, (folder / file).read_text())
    assert count
    (folder / file).write_text(text)
    return parity(folder).returncode


def copied(out: Path, folder: Path) -> Path:
    """The C files of an export, where a library may be built of them."""
    for path in out.glob("epv_*"):
        shutil.copy(path, folder)
    return folder
