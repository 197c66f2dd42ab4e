"""Recurrent-state wrapper: an environment that shows a policy's recurrent state beside the observation.

The recurrent state depends on the observations alone. A learner without memory, such as
stable-baselines3's PPO, therefore trains a recurrent policy when it sees this state: the layers learn,
the recurrent unit stays as it is.
"""

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from controllers.learned import GatedUnit


class RecurrentStateWrapper(VecEnvWrapper):
    """Observations end with the unit's state after it has seen them (`LearnedPolicy.logits`)."""

    def __init__(self, env: VecEnv, cell: GatedUnit):
        """cell: the recurrent unit; its m cells become m entries of the observation, each in [-1, 1]."""
        space = env.observation_space
        assert isinstance(space, gymnasium.spaces.Box)
        limits = np.ones(cell.width, dtype=np.float32)
        low, high = np.append(space.low, -limits), np.append(space.high, limits)
        super().__init__(env, observation_space=gymnasium.spaces.Box(low, high, dtype=np.float32))
        self._cell = cell
        self.state = self._zeros()
        """Of the unit in each episode (n, m)."""

    def reset(self) -> VecEnvObs:
        """First observations (n, entries + m)."""
        self.state = self._zeros()
        return self._with_state(self.venv.reset())

    def step_wait(self) -> VecEnvStepReturn:
        """Observations (n, entries + m), rewards (n,), ends (n,) and infos."""
        observation, reward, done, infos = self.venv.step_wait()
        for i in np.flatnonzero(done):  # the last observation of an episode belongs to its own state
            last = infos[i]["terminal_observation"]
            state = self._cell.step(last[None], self.state[i : i + 1])[0]
            infos[i]["terminal_observation"] = np.append(last, state)
        self.state[done] = 0.0
        return self._with_state(observation), reward, done, infos

    def _zeros(self) -> NDArray:
        return np.zeros((self.num_envs, self._cell.width), dtype=np.float32)

    def _with_state(self, observation: VecEnvObs) -> NDArray:
        assert isinstance(observation, np.ndarray)
        self.state = self._cell.step(observation, self.state)
        return np.concatenate([observation, self.state], axis=1)
