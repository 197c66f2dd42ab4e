"""What the tests of the export share: a policy of random weights, exports, and what they hold."""

import ctypes
import shutil
import subprocess
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from controllers.hysteresis import Hysteresis
from controllers.knowledge import INPUTS
from controllers.network import Network
from controllers.policy_files import write_policy
from epv_env.common.commands import main_of
from epv_env.observation import ENTRIES
from training.deploy.agreement import STATES_EPISODES as EPISODES
from training.deploy.agreement import STATES_PERIODS as PERIODS
from training.deploy.c_code import MEMORY
from training.deploy.compiled import READINGS, READINGS_TYPE, library, logits_of

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


def readings(folder: Path) -> np.ndarray:
    """The readings of states.csv as the C structure, (episodes, periods)."""
    table = np.genfromtxt(folder / "states.csv", delimiter=",", skip_header=1)
    found = np.zeros((EPISODES, PERIODS), dtype=READINGS_TYPE)
    for k, name in enumerate(READINGS, start=1):
        found[name] = table[:, k].reshape(found.shape)
    return found


@dataclass(frozen=True, kw_only=True)
class Replay:
    """How the compiled code of an export acts along states.csv."""

    agreed: int
    """States on which it decides as the controller in Python."""
    observation_error: float
    """Greatest distance of its observations from Python's [1]."""
    margin_error: float
    """The same of the network's logit of on minus that of off, for Python's inputs [1]."""

    @property
    def faithful(self) -> bool:
        """They differ by rounding only: 5e-7 bar at 8 bar, over the least scale of 0.1 bar."""
        return self.agreed >= 9_999 and self.observation_error <= 2e-5 and self.margin_error <= 3e-5


def replay(folder: Path, network: Network) -> Replay:
    """Compile the code in the folder of an export, and drive it along states.csv."""
    code = library(["cc"], folder)
    rows, wanted = inputs(folder), column(folder, "decision")
    memory = np.zeros(1, dtype=MEMORY)
    made = np.zeros_like(rows)
    decided = []
    for k, now in enumerate(readings(folder).ravel()):
        if k % PERIODS == 0:
            memory[:] = np.zeros(1, dtype=MEMORY)
        before, reading = memory.copy(), np.array([now])
        code.epv_policy_observe(_at(before), _at(reading), _at(made[k]))
        decided.append(code.epv_policy_step(_at(memory), _at(reading)))
    layers = [(weight.astype(float), bias.astype(float)) for weight, bias in network.layers]
    exact = replace(network, layers=layers).logits(rows)
    return Replay(
        agreed=int(np.sum(decided == wanted.ravel())),
        observation_error=float(np.abs(made - rows)[:, :ENTRIES].max()),
        margin_error=float(np.abs(np.diff(logits_of(code, rows) - exact)).max()),
    )


def _at(values: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(values.ctypes.data)


def copied(out: Path, folder: Path) -> Path:
    """The C files of an export, where a library may be built of them."""
    for path in out.glob("epv_*"):
        shutil.copy(path, folder)
    return folder


def sanitisers(folder: Path) -> tuple[str, ...]:
    """Options under which a program ends where it does what C leaves undefined; skips without them."""
    options = ("-fsanitize=undefined,address", "-fno-sanitize-recover=all")
    (folder / "empty.c").write_text("int main(void) { return 0; }\n")
    probe = ["cc", *options, folder / "empty.c", "-o", folder / "probe"]
    if subprocess.run(probe, check=False).returncode:
        pytest.skip("this compiler has no sanitisers")
    return options
