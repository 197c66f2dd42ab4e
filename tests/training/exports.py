"""What the tests of the export share: exports of policies that need no training, and what they hold."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np

from controllers.hysteresis import Hysteresis
from epv_env.common.commands import main_of
from epv_env.observation import LAYOUT
from tests.training.policies import Layers, write_policy
from training.deploy.agreement import STATES_EPISODES as EPISODES
from training.deploy.agreement import STATES_PERIODS as PERIODS

GOOD = Hysteresis(open_below=-0.1, shut_above=0.0, shut_lookahead=0.03, name="good")
QUICK = ("--episodes", "4", "--duration", "1")


def command(*words: object) -> int:
    arguments = [str(word) for word in words]
    return main_of("training.commands.export", program="export", arguments=arguments)


def export(policy: Path, out: Path, *more: str) -> int:
    return command(policy, "--out", out, *QUICK, *more)


def export_of(layers: Layers, folder: Path) -> tuple[Path, Path]:
    """Folders of a policy and of its export."""
    policy = write_policy(layers, folder / "policy")
    assert export(policy, folder / "ecu") == 0
    return policy, folder / "ecu"


def column(folder: Path, name: str) -> np.ndarray:
    """One of states.csv, (episodes, periods)."""
    table = np.genfromtxt(folder / "states.csv", delimiter=",", names=True)
    return table[name].reshape(EPISODES, PERIODS)


def observations(folder: Path) -> np.ndarray:
    """Observations (episodes, periods, entries) of states.csv, as float32."""
    table = np.genfromtxt(folder / "states.csv", delimiter=",", skip_header=1)[:, 7:20]
    return table.astype(np.float32).reshape(EPISODES, PERIODS, len(LAYOUT))


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
