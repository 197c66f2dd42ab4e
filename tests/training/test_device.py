"""Episodes on a device give what they give on the processor.

Without an accelerator numba's simulator stands for it, as in tests/env/test_device.py.
"""

import json
import os
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("joblib")
from controllers.base import decides_on_device
from controllers.hysteresis import Hysteresis
from controllers.pulse import InformedPulse
from controllers.tuned import tuned
from docs.examples.relay import Relay
from docs.studies.device.study import controllers, on_cpu
from epv_env.device.kernels import episodes_kernel
from epv_env.period import rules_of
from tests.env.test_device import compiles, simulated
from training.evaluation import batches
from training.evaluation.metrics import METER, count
from training.evaluation.on_device import run_begun
from training.evaluation.rollout import NOTHING

pytestmark = pytest.mark.training

N, PERIODS, RESTART = 3, 40, 20
OPEN: dict[str, Any] = {"open_below": 0.0, "shut_above": 0.0}
SEEDS = [3, 4, 5]
OPTIONS: dict[str, Any] = {
    "settling_time": 0.05, "scenario": "emergency", "drop_bar": (0.2, 0.6),
    "conditions": {"worn": 0.5, "delayed": 0.5}, "threads": 1,
}  # fmt: skip
WITHIN = 1e-4  # Pa, that is 1e-6 mbar


def test_every_controller_decides_on_a_simulated_device_as_on_the_cpu(tmp_path):
    """Two lanes for three episodes: one takes a second episode from the queue."""
    names, cases = (
        list(controllers()),
        [on_cpu(each, SEEDS, PERIODS, RESTART, **OPTIONS) for each in controllers().values()],
    )
    settings = {"periods": PERIODS, "restart": RESTART, "lanes": 2}
    works = [each | settings | {"record": np.zeros((PERIODS, 2, N))} for _, _, each in cases]
    found = simulated(tmp_path, run_begun, works)
    for case, (record, meters, _), (counted, work) in zip(names, cases, found, strict=True):
        np.testing.assert_array_equal(work["record"][:, 0], record[:, 0], err_msg=case)
        np.testing.assert_allclose(work["record"][:, 1], record[:, 1], rtol=0, atol=WITHIN)
        for name in METER.names or ():
            np.testing.assert_allclose(counted[name], meters[name], atol=1e-6, err_msg=name)
        assert np.ptp(record[:, 0]) == 1.0  # it switched


def test_an_episode_does_not_depend_on_the_number_of_lanes(tmp_path):
    """With its own noise, which follows from each episode's key."""
    _, _, work = on_cpu(Hysteresis(**OPEN), SEEDS, 0, **OPTIONS)
    work |= {"noise": NOTHING, "periods": 6}
    works = [work | {"lanes": lanes, "record": np.zeros((6, 2, N))} for lanes in (1, 3)]
    (one, a), (three, b) = simulated(tmp_path, run_begun, works)
    np.testing.assert_array_equal(one, three)
    np.testing.assert_array_equal(a["record"], b["record"])


@pytest.mark.parametrize("name", [pytest.param("PPO", marks=pytest.mark.slow), "hysteresis"])
def test_the_kernel_compiles_for_an_accelerator(name, monkeypatch):
    controller = controllers()[name]
    _, _, work = on_cpu(controller, SEEDS, 0, **OPTIONS)
    arguments = (
        work["begun"], rules_of(work["settings"]), controller.constants, np.zeros(1, controller.record),
        NOTHING, PERIODS, RESTART, np.zeros(1, np.int64), np.zeros(N, METER), NOTHING,
    )  # fmt: skip
    kernel = episodes_kernel(type(controller).decide, controller.record, count, True)
    assert compiles(kernel, arguments, monkeypatch)


def part(device: str) -> batches.Batch:
    """Two short episodes without noise, in worn valves."""
    options = {**OPTIONS, "settling_time": 0.0, "sensor_noise": 0.0}
    return batches.Batch(
        name="", controller="", first_seed=3, episodes=2, duration=0.06, options=options, device=device
    )


def test_a_batch_on_a_simulated_device_gives_the_figures_of_the_cpu(tmp_path):
    work = {"batch": part("cuda"), "controller": tuned("hysteresis")}
    (((_, figures), _),) = simulated(tmp_path, batches._run, [work])
    for name, expected in batches._run(part("cpu"), work["controller"])[1].items():
        np.testing.assert_allclose(figures[name], expected, atol=1e-6, err_msg=name)


def test_a_controller_of_the_host_runs_on_the_processor():
    (asked,), (cpu,) = (batches.run_batches([part(d)], {"": Relay()}, what="") for d in ("cuda", "cpu"))
    np.testing.assert_array_equal(asked.episode_return, cpu.episode_return)


def test_a_controller_with_an_act_of_its_own_decides_on_the_host():
    class Shut(Hysteresis):
        def act(self, observations):
            return np.ones(len(observations), dtype=int)

    found = map(decides_on_device, (*controllers().values(), InformedPulse(), Relay(), Shut(**OPEN)))
    assert list(found) == [True] * len(controllers()) + [False] * 3


def test_batches_of_a_device_are_larger_and_have_names_of_their_own():
    parts, others = (batches.in_batches(replace(part(d), episodes=300_000)) for d in ("cuda", "cpu"))
    assert len(parts) == 2 < len(others)
    assert not {part.name for part in parts} & {part.name for part in others}


@pytest.mark.slow
def test_the_study_runs_in_the_simulator(tmp_path):
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-m", "docs.studies.device.study", "--quick", "--out", tmp_path]
    subprocess.run(command, env=environment, check=True, timeout=600)
    found = json.loads((tmp_path / "figures.json").read_text())
    assert len(found["checks"]) == 2 + len(controllers())
    assert found["relief"][-1][-1] < 1e-5
