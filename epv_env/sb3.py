"""The native vector environment as a stable-baselines3 VecEnv.

from epv_env.sb3 import make_sb3_env
model = PPO("MlpPolicy", make_sb3_env("EPValve-v0", 256))
"""

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices

import epv_env  # noqa: F401 - registers the ids


class SB3VectorEnv(VecEnv):
    """Adapts a Gymnasium vector environment whose autoreset mode is SAME_STEP.

    infos[i] holds "terminal_observation", "TimeLimit.truncated" and the last step's figures (with
    "is_success") where an episode ends, else nothing: figures of every step stay in `last_infos`,
    as arrays.
    """

    def __init__(self, env: gymnasium.vector.VectorEnv):
        """env: for example gymnasium.make_vec(..., autoreset_mode="SameStep")."""
        if env.metadata.get("autoreset_mode") is not AutoresetMode.SAME_STEP:
            raise ValueError(
                "stable-baselines3 needs autoreset in the same step: make the vector environment "
                'with autoreset_mode="SameStep"'
            )
        self.env = env
        self.last_infos: dict[str, Any] = {}
        self._actions = np.empty(0)
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> np.ndarray:
        """Start all episodes anew. Returns observations (n, entries) [-]."""
        seeds: Any = list(self._seeds)  # Gymnasium's base class knows of one seed only
        options = self._options
        if any(options):
            keys = {key for chosen in options for key in chosen}
            merged = {key: [chosen.get(key) for chosen in options] for key in sorted(keys)}
        else:
            merged = None
        observation, _ = self.env.reset(seed=seeds, options=merged)
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return observation

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions, (n,) or (n, 1) [-], for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Advance by one control period.

        Returns observations (n, entries) [-], rewards (n,) [-], whether an episode ended (n,), and one
        dictionary per environment; an episode that ended begins anew.
        """
        observation, reward, terminated, truncated, self.last_infos = self.env.step(self._actions)
        done = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(done):
            final = self.last_infos["final_info"]
            infos[i] = {key: value[i] for key, value in final.items() if not key.startswith("_")}
            infos[i]["terminal_observation"] = self.last_infos["final_obs"][i]
            infos[i]["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
        return observation, reward.astype(np.float32), done, infos

    def close(self) -> None:
        """Release what the vector environment holds."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """The vector environment's attribute, the same for every index."""
        return [getattr(self.env, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set it for all: sub-environments share one object, so a part of them cannot differ."""
        self._require_all(indices)
        setattr(self.env, attr_name, value)

    def env_method(
        self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Call the vector environment's method once and give its result for every index."""
        result = getattr(self.env, method_name)(*args, **kwargs)
        return [result for _ in self._get_indices(indices)]

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper], indices: VecEnvIndices = None
    ) -> list[bool]:
        """False for every index: the batch has no sub-environments to wrap."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[np.ndarray | None]:
        """None for every environment: a batch is not drawn."""
        return [None for _ in range(self.num_envs)]

    def _require_all(self, indices: VecEnvIndices) -> None:
        chosen: Iterable[int] = self._get_indices(indices)
        if set(chosen) != set(range(self.num_envs)):
            raise ValueError("attributes are shared by all sub-environments: leave indices out")


def make_sb3_env(identifier: str = "EPValve-v0", num_envs: int = 256, **options: Any) -> SB3VectorEnv:
    """A batch of `num_envs` valves for stable-baselines3; options as for gymnasium.make_vec."""
    env = gymnasium.make_vec(
        identifier,
        num_envs=num_envs,
        vectorization_mode="vector_entry_point",
        autoreset_mode=AutoresetMode.SAME_STEP,
        to_host=True,
        **options,
    )
    return SB3VectorEnv(env)
