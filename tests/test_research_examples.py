"""The scripts for other libraries run as they are, for a few steps."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.training, pytest.mark.slow]

ROOT = Path(__file__).parents[1]
EXAMPLES = {
    "sb3_contrib": ("sb3_contrib", "400", "'RecurrentPPO': -"),
    "torchrl_ppo": ("torchrl", "2000", "mean reward of a step: -"),
}
"""Library that a script needs, its steps, and a part of what it prints."""


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_script_trains(name):
    library, steps, shown = EXAMPLES[name]
    if importlib.util.find_spec(library) is None:
        pytest.skip(f"{library} is not installed")
    command = (sys.executable, "-m", f"docs.examples.research.{name}", "--timesteps", steps)
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert shown in done.stdout
