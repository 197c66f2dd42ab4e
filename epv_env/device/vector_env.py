"""EPValve-v0 and EPValvePWM-v0 as vector environments whose arrays stay on an NVIDIA accelerator."""

from typing import Any, cast

import numpy as np
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode
from numba import cuda
from numba.core import config

from epv_env.actions import check_unmasked
from epv_env.common.extras import how_to_install
from epv_env.device.kernels import THREADS, Batch, Results, restart, step_kernel
from epv_env.observation import LAYOUT
from epv_env.period import rules_of
from epv_env.plant.equations import State
from epv_env.plant.lanes import N_INPUT, N_STATE
from epv_env.result import N_FIGURE
from epv_env.settings import checked_options
from epv_env.signals import OptionError, check_count
from epv_env.vector_env import EPValvePWMVectorEnv, EPValveVectorEnv, _ValveVectorEnv

SIMULATED = bool(getattr(config, "ENABLE_CUDASIM", False))
"""Whether numba's simulator stands for the device: its arrays are the host's."""

UNLIMITED = 2**62
"""Steps of an episode that nothing truncates."""

_COIL_ENERGY = State._fields.index("coil_energy")


def check_available() -> None:
    """Raises OptionError unless there is an accelerator, and the packages that use it."""
    if not cuda.is_available():
        raise OptionError(
            'device "cuda" needs an NVIDIA accelerator with its driver, and numba-cuda: '
            f"{how_to_install('gpu')}"
        )


class _DeviceVectorEnv(_ValveVectorEnv):
    """n valves on an accelerator, by the functions of the CPU's environment.

    Actions may be arrays of the device (anything with `__cuda_array_interface__`, such as torch's
    tensors) or of the host. Observations (n, entries), rewards, terminated and truncated (n,) are arrays
    of the device. torch reads them without a copy: `torch.as_tensor(observation, device="cuda")`. The
    next step overwrites them. Infos are "figures", (N_FIGURE, n), whose rows epv_env/result.py names,
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

    def __init__(self, num_envs: int = 1, *, starts: int = 4096, **arguments: Any):
        check_available()
        check_count("starts", starts)
        self._most_starts = starts
        super().__init__(num_envs, **arguments)
        if self.privileged:
            raise OptionError("on a device, privileged is False: its truths stay there")
        limit = UNLIMITED if self.max_episode_steps is None else self.max_episode_steps
        self._limits = cuda.to_device(np.full(num_envs, limit, dtype=np.int64))
        self._rules = cuda.to_device(rules_of(self.settings))
        self._key = np.uint64(0)
        self._results = _on_device(blank_results(num_envs))

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
        if any(self.task._signals):
            raise OptionError(
                "a device follows no recordings and moving targets: leave them out, or use the CPU"
            )
        self._key = self._rngs[0].integers(2**64, dtype=np.uint64)
        memory = self.task.memory
        self._starts = _on_device(Batch(*(memory[name] for name in Batch._fields)))
        self._batch = Batch(*(_like(memory[name], self.num_envs) for name in Batch._fields))
        self._with_effects = bool(np.any(memory["with_effects"]))
        self._results.started.copy_to_device(np.zeros(self.num_envs, dtype=np.int64))
        self._results.ended.copy_to_device(np.ones(self.num_envs, dtype=bool))
        self._begin_ended(instead=True)
        self._results.begun.copy_to_device(np.zeros(self.num_envs, dtype=bool))
        return self._results.observation, {}

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        r, asked = self._results, _flat(actions, self.num_envs)
        if self.autoreset_mode is AutoresetMode.NEXT_STEP:
            self._begin_ended(instead=True)
        for extended in (False, True)[: 1 + self._with_effects]:
            kernel = step_kernel(self.action_form.rule, extended)
            self._launch(kernel, self._batch, r, self._rules, asked, self.action.slots, self._key,
                         self._limits, self.task.valves.step)  # fmt: skip
        infos = {"figures": r.figures, "begun": r.begun}
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            self._begin_ended(instead=False)
            infos |= {"final_obs": r.final_observation, "_final_obs": r.ended}
        return r.observation, r.reward, r.terminated, r.truncated, infos

    @property
    def coil_energy(self) -> Any:
        """Electrical energy of each coil so far, an array of the device (n,) [J]."""
        return self._batch.state[_COIL_ENERGY]

    def _begin_ended(self, *, instead: bool) -> None:
        self._launch(restart, self._batch, self._starts, self._results, self._key, instead)

    def _launch(self, kernel: Any, *arguments: Any) -> None:
        threads = min(THREADS, self.num_envs)
        kernel[-(-self.num_envs // threads), threads](*arguments)


def _like(array: np.ndarray, n: int) -> Any:
    """An array of the device for n valves; valves are the last axis."""
    shape, kind = (*array.shape[:-1], n), cast(Any, array.dtype)
    return cuda.device_array(shape, dtype=kind)


def _on_device(arrays: Any) -> Any:
    """A named tuple of the device's arrays for one of NumPy's."""
    return type(arrays)(*map(cuda.to_device, arrays))


def blank_results(n: int) -> Results:
    """Zeros for n valves, NumPy's arrays."""
    entries = len(LAYOUT)
    shapes = {
        "observation": (n, entries), "final_observation": (n, entries), "figures": (N_FIGURE, n),
        "noise": (n, 1, 4), "before": (N_STATE, n), "inputs": (4, N_INPUT, n), "duration": (4, n),
    }  # fmt: skip
    kinds = {"observation": np.float32, "final_observation": np.float32, "started": np.int64}
    kinds |= dict.fromkeys(("terminated", "truncated", "ended", "begun"), np.bool_)
    return Results(*(
        np.zeros(shapes.get(name, (n,)), dtype=kinds.get(name, np.float64))
        for name in Results._fields
    ))  # fmt: skip


def _flat(actions: Any, n: int) -> Any:
    """Actions as an array of the device, (n,). Raises ActionError or OptionError."""
    check_unmasked(actions)
    on_device = hasattr(actions, "__cuda_array_interface__") and not SIMULATED
    array = cuda.as_cuda_array(actions) if on_device else cuda.to_device(np.ascontiguousarray(actions))
    if array.size != n:
        raise OptionError(f"got {array.size} actions for {n} valves: give one each")
    return array.reshape(n)


class EPValveDeviceVectorEnv(_DeviceVectorEnv, EPValveVectorEnv):
    __doc__ = (_DeviceVectorEnv.__doc__ or "") + "Actions: MultiDiscrete, 0 = coil off, 1 = on."


class EPValvePWMDeviceVectorEnv(_DeviceVectorEnv, EPValvePWMVectorEnv):
    __doc__ = (_DeviceVectorEnv.__doc__ or "") + "Actions: Box [-1, 1], (n, 1), see EPValvePWMEnv."


ON_DEVICE = {EPValveVectorEnv: EPValveDeviceVectorEnv, EPValvePWMVectorEnv: EPValvePWMDeviceVectorEnv}
"""The environment of the device for that of the CPU."""
