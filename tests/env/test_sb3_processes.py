"""Worker processes of every start method work, also after the parent has used a threaded batch."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.training
def test_worker_processes_agree_with_their_parent():
    pytest.importorskip("stable_baselines3")
    done = subprocess.run(
        [sys.executable, "-m", "tests.env.sb3_processes"],
        cwd=ROOT, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.stdout.split("\n")[:4] == [
        "fork True", "forkserver True", "spawn True", "threads True",
    ], done.stderr  # fmt: skip
