"""Worker processes of every start method work, also after the parent has used a threaded batch."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.training
@pytest.mark.parametrize("method", ["fork", "forkserver", "spawn"])
def test_subproc_vec_env_works(method):
    pytest.importorskip("stable_baselines3")
    done = subprocess.run(
        [sys.executable, "-m", "tests.env.sb3_processes", method],
        cwd=ROOT, capture_output=True, text=True, timeout=180, check=False,
    )  # fmt: skip
    assert done.stdout.strip() == "same", done.stderr
