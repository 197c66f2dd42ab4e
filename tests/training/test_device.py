"""Evaluation on a device, which numba's simulator stands for, in processes of their own."""

import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
from controllers.hysteresis import Hysteresis
from training.evaluation.batches import Batch, _run, in_batches

pytestmark = [pytest.mark.training, pytest.mark.slow]
CONTROLLER = Hysteresis(open_below=0.0, shut_above=0.0)


def batch(device: str) -> Batch:
    """Two short episodes without noise, in worn valves."""
    conditions = {"worn": 1.0, "delayed": 1.0}
    options = {"sensor_noise": 0.0, "settling_time": 0.0, "conditions": conditions}
    return Batch(
        name="", controller="", first_seed=3, episodes=2, duration=0.06, options=options, device=device
    )


EVALUATE = """
import pickle, sys
from tests.training.test_device import CONTROLLER, _run, batch

pickle.dump(_run(batch("cuda"), CONTROLLER)[1], open(sys.argv[1], "wb"))
"""


def simulate(code: str, *paths: Path) -> None:
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"}
    subprocess.run([sys.executable, "-c", code, *paths], env=environment, check=True, timeout=600)


def test_a_batch_on_a_simulated_device_gives_the_figures_of_the_cpu(tmp_path: Path):
    file = tmp_path / "figures"
    simulate(EVALUATE, file)
    figures = pickle.loads(file.read_bytes())
    for name, expected in _run(batch("cpu"), CONTROLLER)[1].items():
        np.testing.assert_allclose(figures[name], expected, atol=1e-6, err_msg=name)


def test_batches_of_a_device_are_larger_and_have_names_of_their_own():
    parts, others = (in_batches(replace(batch(d), episodes=9000)) for d in ("cuda", "cpu"))
    assert len(parts) == 2 < len(others)
    assert not {part.name for part in parts} & {part.name for part in others}
