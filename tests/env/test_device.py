"""The environments of a device give what those of the CPU give.

Without an accelerator: numba's simulator runs the kernels, and all that they call, as plain Python.
"""

import os
import subprocess
import sys
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import gymnasium
import numba
import numpy as np
import pytest

import epv_env  # noqa: F401 - registers the ids
from epv_env.actions import OnOff
from epv_env.device.kernels import Batch, restart, step_kernel
from epv_env.device.random import draw_normals, philox
from epv_env.device.vector_env import blank_results
from epv_env.period import rules_of
from epv_env.signals import OptionError

N, PERIODS = 4, 12
WITHIN = 1e-4  # Pa, that is 1e-6 mbar
WORN = {"worn": 1.0, "delayed": 1.0, "vented": 0.5, "target_steps": 1.0}
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "ordinary": ("EPValve-v0", {}),
    "effects, delay and duty": ("EPValvePWM-v0", {"conditions": WORN}),
}


def made(case: str, device: str) -> Any:
    identifier, options = CASES[case]
    options = {"sensor_noise": 0.0, "max_episode_steps": PERIODS, **options}
    return gymnasium.make_vec(identifier, num_envs=N, device=device, **options)


def on_host(array: Any) -> np.ndarray:
    return np.array(array.copy_to_host() if hasattr(array, "copy_to_host") else array)


def rollout(case: str, device: str) -> dict[str, np.ndarray]:
    """p2 [Pa], observations and rewards of N random episodes and of the first step after them."""
    envs, rng, found = made(case, device), np.random.default_rng(0), []
    observation, _ = envs.reset(seed=3)
    first = on_host(observation)
    for period in range(PERIODS + 1):
        random = rng.random(N) * (period > 3)  # off until the valves open
        actions = random > 0.5 if envs.action_form is OnOff else 2.0 * random[:, None] - 1.0
        observation, reward, *ends, _ = envs.step(actions)
        state = on_host(envs._batch.state) if device == "cuda" else envs.task.valves.tables.state
        found.append((state[0, :N].copy(), on_host(observation), on_host(reward), *map(on_host, ends)))
    names = ("p2", "observation", "reward", "terminated", "truncated")
    return dict(zip(names, map(np.array, zip(*found, strict=True)), strict=True)) | {"first": first}


def simulated(folder: Any, case: str) -> dict[str, np.ndarray]:
    """`rollout` on the simulated device, in a process of its own."""
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-m", "tests.env.test_device", case, str(folder / "found.npz")]
    subprocess.run(command, env=environment, check=True, timeout=600)
    return dict(np.load(folder / "found.npz"))


@pytest.mark.parametrize("case", CASES)
def test_a_simulated_device_agrees_with_the_cpu(case, tmp_path):
    device, cpu = simulated(tmp_path, case), rollout(case, "cpu")
    assert np.ptp(cpu["p2"], axis=0).max() > 2e4  # a valve opened
    np.testing.assert_allclose(device["p2"][:PERIODS], cpu["p2"][:PERIODS], rtol=0, atol=WITHIN)
    np.testing.assert_array_equal(device["first"], cpu["first"])
    for name in ("observation", "reward", "terminated", "truncated"):
        np.testing.assert_allclose(device[name][:PERIODS], cpu[name][:PERIODS], rtol=0, atol=1e-6)
    assert np.all(device["truncated"][PERIODS - 1])
    assert not np.any(device["truncated"][PERIODS] | (device["reward"][PERIODS] != 0))
    anew = device["observation"][PERIODS]  # every one is the beginning of a start
    assert all(np.any(np.all(each == device["first"], axis=1)) for each in anew)


def test_random_numbers_are_those_of_the_published_generator():
    """First known answer of Random123 (kat_vectors, philox4x32 10)."""
    zero = np.uint64(0)
    assert list(map(int, philox(zero, zero, zero, zero, zero))) == [
        0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8,
    ]  # fmt: skip
    drawn = np.empty((20_000, 4))
    for step in range(len(drawn)):
        draw_normals(np.uint64(1), 0, 1, step, 0, 1.0, drawn[step])
    assert np.all(np.abs(drawn.mean(axis=0)) < 0.03)
    np.testing.assert_allclose(np.cov(drawn.T), np.eye(4), atol=0.04)


@pytest.mark.parametrize("extended", [False, True], ids=["nominal", "extended"])
def test_the_kernels_compile_for_an_accelerator(extended, monkeypatch):
    pytest.importorskip("numba_cuda", reason="no compiler for accelerators: install the extra gpu")
    dispatcher, cuda = import_module("numba.cuda.dispatcher"), import_module("numba.cuda")
    h100 = SimpleNamespace(compute_capability=(9, 0))
    monkeypatch.setattr(dispatcher, "get_current_device", lambda: h100)  # needs no driver then
    task = made("ordinary", "cpu").task
    b, r = Batch(*(task.memory[name] for name in Batch._fields)), blank_results(task.n)
    key, actions = np.uint64(1), np.zeros(task.n)
    arguments = {
        step_kernel(OnOff.rule, extended): (b, r, rules_of(task.settings), actions, 1, key, 1, 2e-4),
        restart: (b, b, r, key, True),
    }
    for kernel, values in arguments.items():
        types = tuple(map(numba.typeof, values))
        ptx, _ = cuda.compile_ptx(kernel.py_func, types, cc=h100.compute_capability)
        assert ".target sm_90" in ptx


def test_a_device_that_is_not_there_is_refused():
    from numba import cuda

    if cuda.is_available():
        pytest.skip("there is a device")
    with pytest.raises(OptionError, match=r"epv-valve\[gpu\]"):
        made("ordinary", "cuda")
    with pytest.raises(OptionError, match="'cpu' or 'cuda'"):
        made("ordinary", "tpu")


if __name__ == "__main__":
    np.savez(sys.argv[2], **rollout(sys.argv[1], "cuda"))  # type: ignore[arg-type]
