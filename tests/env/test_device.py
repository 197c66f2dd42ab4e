"""The environments of a device give what those of the CPU give.

Without an accelerator: numba's simulator runs the kernels, and all that they call, as plain Python.
"""

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium
import numba
import numpy as np
import pytest

import epv_env  # noqa: F401 - registers the ids
from epv_env.actions import ActionError, OnOff
from epv_env.device.kernels import INSTEAD, Batch, copy_actions, step_kernel
from epv_env.device.random import draw_normals, philox
from epv_env.device.vector_env import EPValveDeviceVectorEnv, blank_results
from epv_env.period import rules_of
from epv_env.plant.lanes import N_STATE
from epv_env.signals import OptionError

N, PERIODS = 4, 12
LIMITS = [PERIODS] * (N - 1) + [2 * PERIODS]  # the last valve goes on
WITHIN = 1e-4  # Pa, that is 1e-6 mbar
WORN = {"worn": 1.0, "delayed": 1.0, "vented": 0.5, "target_steps": 1.0}
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "ordinary": ("EPValve-v0", {}),
    "effects, delay and duty": (
        "EPValvePWM-v0",
        {"conditions": WORN, "parameters": {"w_delay": (-0.5, 1.0)}, "autoreset_mode": "SameStep"},
    ),
}
NAMES = ("p2", "observation", "reward", "terminated", "truncated", "deviation", "shown")


def made(case: str, device: str) -> Any:
    """The environments of a case."""
    identifier, options = CASES[case]
    options = {"sensor_noise": 0.0, "max_episode_steps": LIMITS, **options}
    return gymnasium.make_vec(identifier, num_envs=N, device=device, to_host=True, **options)


def state_of(envs: Any) -> np.ndarray:
    """The true state, (N_STATE, n) [SI]."""
    batch = getattr(envs.unwrapped, "_batch", None)
    return batch.numbers[:N_STATE].copy_to_host() if batch else np.array(envs.task.valves.tables.state)


def final_of(infos: dict[str, Any]) -> np.ndarray:
    """The figures and the last observation of the episodes that ended, (n - 1, all)."""
    figures = np.array([value for _, value in sorted(infos["final_info"].items())], dtype=float)
    return np.column_stack([figures[:, :-1].T, np.stack(infos["final_obs"][:-1])])


def compiles(kernel: Any, arguments: tuple[Any, ...], monkeypatch: Any) -> bool:
    """Whether a kernel becomes code for compute capability 9.0, without a driver."""
    pytest.importorskip("numba_cuda", reason="no compiler for accelerators: install the extra gpu")
    dispatcher, cuda = import_module("numba.cuda.dispatcher"), import_module("numba.cuda")
    h100 = SimpleNamespace(compute_capability=(9, 0))
    monkeypatch.setattr(dispatcher, "get_current_device", lambda: h100)
    types = tuple(map(numba.typeof, arguments))
    ptx, _ = cuda.compile_ptx(kernel.py_func, types, cc=h100.compute_capability)
    return ".target sm_90" in ptx


def rollout(case: str, device: str) -> dict[str, np.ndarray]:
    """p2 [Pa] and what steps give, N random episodes and a step more; "final" in SAME_STEP."""
    envs, rng, found, more = made(case, device), np.random.default_rng(0), [], {}
    more["first"], _ = envs.reset(seed=3)
    for period in range(PERIODS + 1):
        random = rng.random(N) * (period > 3)  # off until the valves open
        actions = random > 0.5 if envs.unwrapped.action_form is OnOff else 2.0 * random[:, None] - 1.0
        actions = np.repeat(actions, 2, axis=0)[::2]  # not contiguous
        *given, infos = envs.step(actions)
        found.append((state_of(envs)[0, :N], *given, infos["deviation_bar"], infos["_deviation_bar"]))
        if "final_info" in infos:
            more["final"] = final_of(infos)
    return dict(zip(NAMES, map(np.array, zip(*found, strict=True)), strict=True)) | more


SIMULATE = """
import pickle, sys
import numpy as np
from numba.cuda.simulator.kernelapi import FakeCUDALocal

array = FakeCUDALocal.array

def undefined(self, shape, dtype, **options):
    made = array(self, shape, dtype, **options)
    made.view(np.uint8)[...] = 255  # NaN: a device's memory is not zero at first
    return made

FakeCUDALocal.array = undefined
function, works = pickle.load(open(sys.argv[1], "rb"))
pickle.dump([(function(**work), work) for work in works], open(sys.argv[1], "wb"))
"""


def simulated(folder: Path, function: Callable[..., Any], works: list[dict[str, Any]]) -> list[Any]:
    """What a function gives for these arguments on the simulated device, and the arguments then.

    In a process of its own, where nothing else is compiled.
    """
    file = folder / "works"
    file.write_bytes(pickle.dumps((function, works)))
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"}
    subprocess.run([sys.executable, "-c", SIMULATE, file], env=environment, check=True, timeout=600)
    return pickle.loads(file.read_bytes())


@pytest.mark.parametrize("case", CASES)
def test_a_simulated_device_agrees_with_the_cpu(case, tmp_path):
    ((device, _),) = simulated(tmp_path, rollout, [{"case": case, "device": "cuda"}])
    cpu = rollout(case, "cpu")
    assert np.ptp(cpu["p2"], axis=0).max() > 2e4  # a valve opened
    same_step = "final" in cpu
    anew = PERIODS - same_step  # the step that shows new episodes
    np.testing.assert_allclose(device["p2"][:anew], cpu["p2"][:anew], rtol=0, atol=WITHIN)
    np.testing.assert_allclose(
        device["observation"][:anew], cpu["observation"][:anew], rtol=0, atol=1e-6
    )
    np.testing.assert_array_equal(device["first"], cpu["first"])
    for name in ("reward", "terminated", "truncated", "deviation", "shown"):
        until = PERIODS if same_step else PERIODS + 1
        np.testing.assert_allclose(device[name][:until], cpu[name][:until], rtol=0, atol=1e-6)
    np.testing.assert_array_equal(device["truncated"][PERIODS - 1], [True] * (N - 1) + [False])
    if same_step:
        np.testing.assert_allclose(device["final"], cpu["final"], rtol=0, atol=1e-6)
    for each in device["observation"][anew][:-1]:  # the beginning of a start
        assert np.any(np.all(each == device["first"], axis=1))


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


@pytest.mark.parametrize("kernel", [0, 1, 2], ids=["nominal", "with effects", "with laws"])
def test_the_kernels_compile_for_an_accelerator(kernel, monkeypatch):
    task = made("ordinary", "cpu").task
    b, r = Batch.of(task), blank_results(task.n)
    actions, limits = np.zeros(task.n), np.zeros(task.n, dtype=np.int64)
    arguments = (b, b, r, rules_of(task.settings), actions, 1, limits, INSTEAD)
    assert compiles(step_kernel(OnOff.rule, kernel), arguments, monkeypatch)
    for kind in (np.int64, np.float32, np.bool_):
        strided = np.zeros((task.n, 2), dtype=kind)[:, 0]
        assert compiles(copy_actions, (strided, actions), monkeypatch)


def test_a_device_that_is_not_there_is_refused():
    from numba import cuda

    if cuda.is_available():
        pytest.skip("there is a device")
    with pytest.raises(OptionError, match=r"'\.\[gpu\]'"):
        made("ordinary", "cuda")
    with pytest.raises(OptionError, match="'cpu' or 'cuda'"):
        made("ordinary", "tpu")


@pytest.mark.parametrize(
    ("actions", "words"),
    [
        (SimpleNamespace(requires_grad=True), r"give actions.detach\(\)"),
        (np.zeros(2, dtype="V2"), "bfloat16 as float32"),  # as torch shows its bfloat16
        (np.zeros((2, 2)), "each of 2 valves"),
        ([0, 1, 1], "each of 2 valves"),
    ],
)
def test_actions_that_a_device_cannot_take_are_refused(actions, words):
    with pytest.raises(ActionError, match=words):
        EPValveDeviceVectorEnv._taken_in(SimpleNamespace(num_envs=2), actions)  # type: ignore[arg-type]


def test_an_option_of_the_device_is_refused_on_the_cpu():
    with pytest.raises(OptionError, match="starts is an option of device"):
        gymnasium.make_vec("EPValve-v0", num_envs=2, starts=1)
