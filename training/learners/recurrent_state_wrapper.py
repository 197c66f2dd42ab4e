"""An environment that shows a policy's memory beside the observation.

The memory depends on what was observed alone, so that a learner without one that sees it, as
stable-baselines3's PPO, trains a policy with a memory: the layers learn, the unit stays as it is.
"""

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from controllers.learned import GatedUnit


class RememberingEnv(VecEnvWrapper):
    """Observations end with what the unit remembers once it has seen them (`LearnedPolicy.logits`)."""

    def __init__(self, env: VecEnv, cell: GatedUnit):
        space = env.observation_space
        assert isinstance(space, gymnasium.spaces.Box)
        limits = np.ones(cell.width, dtype=np.float32)
        low, high = np.append(space.low, -limits), np.append(space.high, limits)
        super().__init__(env, observation_space=gymnasium.spaces.Box(low, high, dtype=np.float32))
        self._cell = cell
        self._memory = self._nothing()

    def reset(self) -> VecEnvObs:
        self._memory = self._nothing()
        return self._remembering(self.venv.reset())

    def step_wait(self) -> VecEnvStepReturn:
        observation, reward, done, infos = self.venv.step_wait()
        for i in np.flatnonzero(done):  # the last observation of an episode belongs to its own memory
            last = infos[i]["terminal_observation"]
            memory = self._cell.step(last[None], self._memory[i : i + 1])[0]
            infos[i]["terminal_observation"] = np.append(last, memory)
        self._memory[done] = 0.0
        return self._remembering(observation), reward, done, infos

    def _nothing(self) -> NDArray:
        return np.zeros((self.num_envs, self._cell.width), dtype=np.float32)

    def _remembering(self, observation: VecEnvObs) -> NDArray:
        assert isinstance(observation, np.ndarray)
        self._memory = self._cell.step(observation, self._memory)
        return np.concatenate([observation, self._memory], axis=1)
