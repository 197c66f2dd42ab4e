"""What the tests of sweeps share: short sweeps, and policies that need no training."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

from controllers.policy_contract import CONTRACT_FILE, FORMAT, WEIGHTS_FILE
from epv_env.observation import LAYOUT, contract
from training.sweep import main

ROOT = Path(__file__).parents[2]
SHORT = (
    "--designs", "conditions", "hypercube", "worst", "--factors", "sensor noise", "control period",
    "--episodes", 3, "--joint-episodes", 8, "--duration", 0.55, "--screened", 8, "--generations", 1,
)  # fmt: skip
"""A sweep of a few seconds."""
TASKS = 2 + 4 + 4 + 1
"""Searches, levels of both factors, and hypercube of SHORT with one controller."""


def write_policy(folder: Path, seed: int = 0) -> Path:
    """A policy of random weights."""
    rng = np.random.default_rng(seed)
    shapes = [(16, len(LAYOUT)), (16, 16), (2, 16)]
    arrays = {f"{i}.weight": rng.standard_normal(s).astype(np.float32) for i, s in enumerate(shapes)}
    arrays |= {f"{i}.bias": np.zeros(s[0], dtype=np.float32) for i, s in enumerate(shapes)}
    content = {
        "format": FORMAT, "environment": "EPValve-v0", "layers": len(shapes),
        "observation": contract(5e-3),
    }  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    save_file(arrays, folder / WEIGHTS_FILE)
    (folder / CONTRACT_FILE).write_text(json.dumps(content))
    return folder


def sweep(out: Path, *arguments) -> bytes:
    """Run a sweep in this process; returns results.json."""
    assert main([*map(str, SHORT), "--out", str(out), *map(str, arguments)]) == 0
    return (out / "results.json").read_bytes()


def sweep_process(out: Path, *arguments) -> subprocess.Popen:
    """Start a sweep as a user does, in a process group of its own."""
    command = [sys.executable, ROOT / "training/sweep.py", *SHORT, "--out", out, *arguments]
    return subprocess.Popen(
        [str(part) for part in command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=_heed_interrupts,
    )  # fmt: skip


def _heed_interrupts() -> None:
    """Tests that run in the background of a script have been told to ignore them, and so would it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def finished(out: Path) -> list[str]:
    """Names of the tasks in a sweep's journal, as they finished; torn lines do not count."""
    path = out / "finished.jsonl"
    text = path.read_text() if path.exists() else ""
    complete = text[: text.rfind("\n") + 1]
    return [json.loads(line)["name"] for line in complete.splitlines()[1:]]
