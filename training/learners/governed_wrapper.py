"""The environment under a governor: a policy learns with the corrections that it will act with.

The governor (controllers/governor.py) shows the policy a p2 that suits the valve and overrules what
would rise too far. To PPO both belong to the environment, so the policy learns what is left to do.
"""

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from controllers.governor import Governor, lowered


class GovernedWrapper(VecEnvWrapper):
    """Shifted observations, and the coil on where it has to be."""

    def __init__(self, env: VecEnv, governor: Governor):
        """
        Args:
            env: n episodes of the on/off environment, whose observations begin with an ECU's.
            governor: its margin is left out, since PPO draws actions by the policy's own logits.
        """
        super().__init__(env)
        self.governor = governor
        n = env.num_envs
        governor.reset(n)
        self.shift = np.zeros(n)
        """How much lower p2 is shown (n,) [bar]."""
        self.must_shut = np.zeros(n, dtype=bool)
        """Whether the coil has to be on (n,)."""

    def reset(self) -> VecEnvObs:
        """First observations (n, entries)."""
        self.governor.reset(self.num_envs)
        return self._advised(self.venv.reset())

    def step_async(self, actions: NDArray) -> None:
        """Start a control period with the corrected actions (n,)."""
        corrected = np.where(self.must_shut, 1, actions)
        self.governor.decided(corrected)
        self.venv.step_async(corrected)

    def step_wait(self) -> VecEnvStepReturn:
        """Observations (n, entries), rewards (n,), ends (n,) and infos.

        The last observation of an episode is shown with the shift of the period before.
        """
        observation, reward, done, infos = self.venv.step_wait()
        ended = np.flatnonzero(done)
        if len(ended):
            last = np.stack([infos[i]["terminal_observation"] for i in ended])
            for i, shown in zip(ended, lowered(last, self.shift[ended]), strict=True):
                infos[i]["terminal_observation"] = shown
            self.governor.forget(ended)
        return self._advised(observation), reward, done, infos

    def _advised(self, observation: VecEnvObs) -> NDArray:
        """Observations (n, entries) as the policy is shown them; takes note of the governor's advice."""
        assert isinstance(observation, np.ndarray)
        advice = self.governor.advise(observation)
        self.shift, self.must_shut = advice.shift, advice.must_shut
        return lowered(observation, self.shift)
