"""EPValve-v0 and EPValvePWM-v0 as vector environments whose arrays stay on an NVIDIA accelerator."""

from typing import Any

import numpy as np
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode
from numba import cuda
from numba.core import config

from epv_env.actions import ActionError, as_array
from epv_env.common.extras import how_to_install
from epv_env.device import kernels
from epv_env.period import rules_of
from epv_env.result import N_FIGURE
from epv_env.settings import checked_options
from epv_env.signals import OptionError, check_count
from epv_env.vector_env import EPValvePWMVectorEnv, EPValveVectorEnv, _ValveVectorEnv

SIMULATED = bool(getattr(config, "ENABLE_CUDASIM", False))
"""Whether numba's simulator stands for the device: its arrays are the host's."""

LEGACY_STREAM = 1
"""Numba's default stream, as DLPack numbers streams."""


def check_available() -> None:
    """Raises OptionError unless there is an accelerator, and the packages that use it."""
    if not cuda.is_available():
        raise OptionError(
            'device "cuda" needs an NVIDIA accelerator with its driver, and numba-cuda: '
            f"{how_to_install('gpu')}"
        )


class _DeviceVectorEnv(_ValveVectorEnv):
    """n valves on an accelerator; each step overwrites the arrays that the step before gave.

    Actions may be arrays of the device (anything with `__cuda_array_interface__`, such as torch's
    tensors) or of the host, of any real type; what computes them on another stream is waited for.
    Observations (n, entries), rewards, terminated and truncated (n,) are arrays of the device, computed
    on its default stream. torch reads them without a copy: `torch.as_tensor(x, device="cuda")`; clone
    what shall outlast the step. Infos are "figures", (N_FIGURE, n), whose rows epv_env/result.py names,
    and "begun" (n,): an episode began instead of the step. SAME_STEP adds "final_obs" (n, entries),
    valid where an episode ended ("_final_obs").

    In reset the host draws the starts of episodes: those of the CPU's sub-environments with the same
    seeds. Valve i begins with start i, modulo their number; later episodes begin with any of them, drawn
    on the device. Noise comes from another generator than the CPU's. The same seed gives the same result
    on the same device.

    An action outside the action space makes the reward NaN. Arguments as for the CPU's environment,
    without `privileged`, recorded signals and moving targets; DISABLED resets all episodes at once, and
    lets ended ones run on. And:
        starts: number of different starts, at most num_envs.
    """

    most_envs = 10_000_000

    def __init__(self, num_envs: int = 1, *, starts: int = 4096, **arguments: Any):
        check_available()
        check_count("starts", starts)
        self._most_starts = starts
        super().__init__(num_envs, **arguments)
        if self.privileged:
            raise OptionError("on a device, privileged is False: its truths stay there")
        limit = 2**62 if self.max_episode_steps is None else self.max_episode_steps
        self._limits = cuda.to_device(np.full(num_envs, limit, dtype=np.int64))
        self._rules = cuda.to_device(rules_of(self.settings))
        self._asked = cuda.device_array(num_envs)

    def _on_host(self, num_envs: int) -> int:
        return min(num_envs, self._most_starts)

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict]:
        """Draw new starts and begin all episodes."""
        options = checked_options(options)
        if "reset_mask" in options:
            raise OptionError("on a device all episodes are reset at once: leave reset_mask out")
        for i, each in enumerate(self._seeds(seed)[: self.task.n]):
            if each is not None:
                self._rngs[i] = np_random(each)[0]
        self._begin(np.arange(self.task.n), options)
        starts = kernels.Batch.of(self.task)
        self._kernel = int(np.max(starts.numbers[kernels.KERNEL]))
        self._starts = on_device(starts)
        shapes = [(*each.shape[:-1], self.num_envs) for each in starts]
        blanks = map(cuda.device_array, shapes, [each.dtype for each in starts])
        self._batch = kernels.Batch(*blanks)
        self._results = on_device(blank_results(self.num_envs))
        self._launch(self._results.reward, kernels.INSTEAD)
        return self._results.observation, {}

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        r = self._results
        self._launch(self._taken_in(actions), list(AutoresetMode).index(self.autoreset_mode))
        infos = {"figures": r.figures, "begun": r.begun}
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            infos |= {"final_obs": r.final_observation, "_final_obs": r.ended}
        return r.observation, r.reward, r.terminated, r.truncated, infos

    def _launch(self, actions: Any, ending: int) -> None:
        kernel = kernels.step_kernel(self.action_form.rule, self._kernel)
        kernels.launch(
            kernel, self.num_envs, self._batch, self._starts, self._results, self._rules, actions,
            self.action.slots, self._limits, ending,
        )  # fmt: skip

    def _taken_in(self, actions: Any) -> Any:
        """Actions as a contiguous array of float64 of the device, (n,). Raises ActionError."""
        array = _array_of(actions)
        if array.shape not in ((self.num_envs,), (self.num_envs, 1)) or array.dtype.kind not in "biuf":
            raise ActionError(
                f"actions of shape {array.shape} and type {array.dtype}: give a real number for each of "
                f"{self.num_envs} valves, bfloat16 as float32"
            )
        column = array if array.ndim == 1 else array[:, 0]
        if isinstance(column, np.ndarray):
            column = cuda.to_device(column.astype(float))
        kernels.launch(kernels.copy_actions, self.num_envs, column, self._asked)
        return self._asked


def _array_of(actions: Any) -> Any:
    """Actions as an array of NumPy or of the device. Raises ActionError."""
    if getattr(actions, "requires_grad", False):
        raise ActionError("actions require a gradient: give actions.detach()")
    if SIMULATED or not hasattr(actions, "__cuda_array_interface__"):
        return as_array(actions)
    if hasattr(actions, "__dlpack__"):  # makes the device wait for what computes them
        actions.__dlpack__(stream=LEGACY_STREAM)
    return cuda.as_cuda_array(actions)


def on_device(value: Any) -> Any:
    """NumPy's arrays in named tuples of any depth as the device's; numbers stay what they are."""
    if isinstance(value, tuple):
        return type(value)(*map(on_device, value))
    return cuda.to_device(value) if isinstance(value, np.ndarray) else value


def blank_results(n: int) -> kernels.Results:
    """Of n valves whose episodes are to begin: NumPy's arrays, zeros."""
    wide = (n, kernels.ENTRIES)
    numbers, bools = (lambda: np.zeros(n)), (lambda: np.zeros(n, dtype=bool))
    return kernels.Results(
        observation=np.zeros(wide, np.float32), final_observation=np.zeros(wide, np.float32),
        reward=numbers(), terminated=bools(), truncated=bools(), ended=~bools(), begun=bools(),
        started=np.zeros(n, np.int64), figures=np.zeros((N_FIGURE, n)),
    )  # fmt: skip


class EPValveDeviceVectorEnv(_DeviceVectorEnv, EPValveVectorEnv):
    __doc__ = (_DeviceVectorEnv.__doc__ or "") + "Actions: MultiDiscrete, 0 = coil off, 1 = on."


class EPValvePWMDeviceVectorEnv(_DeviceVectorEnv, EPValvePWMVectorEnv):
    __doc__ = (_DeviceVectorEnv.__doc__ or "") + "Actions: Box [-1, 1], (n, 1), see EPValvePWMEnv."


ON_DEVICE = {EPValveVectorEnv: EPValveDeviceVectorEnv, EPValvePWMVectorEnv: EPValvePWMDeviceVectorEnv}
"""The environment of the device for that of the CPU."""
