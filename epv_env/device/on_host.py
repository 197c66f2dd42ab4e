"""An accelerator's environments for code that takes NumPy's arrays, such as stable-baselines3."""

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorWrapper
from numpy.typing import NDArray

from epv_env.result import StepResult
from epv_env.vector_env import keep_final, masked_info


class OnHost(VectorWrapper):
    """A device's environment whose steps give NumPy's arrays and the CPU's infos.

    Each step copies them to the host once.
    """

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[NDArray, dict]:
        """As of the device's environment; observations (n, entries) are an array of the host."""
        observation, infos = self.env.reset(seed=seed, options=options)
        return observation.copy_to_host(), infos

    def step(self, actions: Any) -> tuple[NDArray, NDArray, NDArray, NDArray, dict[str, Any]]:
        """As the CPU's environment: observations (n, entries), the rest (n,), infos by key."""
        *found, shown = self.env.step(actions)
        observation, reward, terminated, truncated = (each.copy_to_host() for each in found)
        result = StepResult(observation, shown["figures"].copy_to_host())
        infos = masked_info(result, ~shown["begun"].copy_to_host())
        ended = terminated | truncated
        if self.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP and np.any(ended):
            keep_final(infos, shown["final_obs"].copy_to_host(), ended)
        return observation, reward, terminated, truncated, infos
