"""An environment that shows the plant beside the observation, and a policy that has learned there.

No ECU knows its plant's parameters, but what a policy would do if it did is the best example for one
that has to find them out: "learning by cheating" (Chen et al., CoRL 2019), "RMA: rapid motor
adaptation" (Kumar et al., RSS 2021). training/distil.py has the policy that follows the example.
"""

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from controllers.learned import LearnedPolicy
from controllers.pulse import Pulse
from controllers.pulse_table import PulseTables
from epv_env.plant.parameters import Parameters, sensitive_symbols
from epv_env.task import LimitingTask

FARTHEST = 5.0
"""Where a parameter's code saturates: 50 % off the centre."""


def plant_code(task: LimitingTask) -> NDArray:
    """How far each sensitive parameter is off the region's centre, in tenths of it: (n, 13) float32."""
    symbols, centre = sensitive_symbols(), task.settings.region.centre
    values = [[plant[s] for s in symbols] for plant in _plants(task)]
    nominal = np.array([centre[s] for s in symbols])
    return np.clip(10 * (np.array(values) / nominal - 1), -FARTHEST, FARTHEST).astype(np.float32)


def _plants(task: LimitingTask) -> list[Parameters]:
    plants = [parameters for parameters in task.parameters if parameters is not None]
    assert len(plants) == task.n, "the episodes must have begun"
    return plants


class InformedEnv(VecEnvWrapper):
    """A training environment (epv_env.sb3) whose observations end with the plant's code."""

    def __init__(self, env: VecEnv):
        space = env.observation_space
        assert isinstance(space, gymnasium.spaces.Box)
        limits = np.full(len(sensitive_symbols()), FARTHEST, dtype=np.float32)
        low, high = np.append(space.low, -limits), np.append(space.high, limits)
        super().__init__(env, observation_space=gymnasium.spaces.Box(low, high, dtype=np.float32))
        self._task: LimitingTask = env.get_attr("task")[0]
        self._code = np.empty((0, 0))

    def reset(self) -> VecEnvObs:
        observation = self.venv.reset()
        self._code = plant_code(self._task)
        return self._informed(observation)

    def step_wait(self) -> VecEnvStepReturn:
        observation, reward, done, infos = self.venv.step_wait()
        for i in np.flatnonzero(done):  # the last observation of an episode belongs to its own plant
            last = infos[i]["terminal_observation"]
            infos[i]["terminal_observation"] = np.append(last, self._code[i])
        if np.any(done):
            self._code = plant_code(self._task)
        return self._informed(observation), reward, done, infos

    def _informed(self, observation: VecEnvObs) -> NDArray:
        assert isinstance(observation, np.ndarray)
        return np.concatenate([observation, self._code], axis=1)


class Informed:
    """A policy that has learned in an InformedEnv, as a controller that is shown the plant."""

    def __init__(self, policy: LearnedPolicy):
        self.policy = policy
        self.name = f"{policy.name}, informed"
        self.environment = policy.environment
        self._code = np.empty((0, 0))

    def reset(self, n: int) -> None:
        """Nothing to forget: each batch is watched anew."""

    def watch(self, task: LimitingTask) -> None:
        """See which plants the episodes have that have just begun."""
        self._code = plant_code(task)

    def act(self, observations: NDArray) -> NDArray:
        """The policy's actions for observations (n, entries)."""
        return np.argmax(self.logits(observations), axis=1)

    def logits(self, observations: NDArray) -> NDArray:
        """The policy's logits (n, actions) for observations (n, entries)."""
        return self.policy.logits(np.concatenate([observations, self._code], axis=1))


class InformedPulse:
    """The pulse controller with a table of each valve's own plant: an informed model imitates it."""

    def __init__(self, values: dict[str, Any]):
        """values: the pulse controller's searched quantities (controllers/tuned.json)."""
        self.name = "pulse, informed"
        self.environment = "EPValve-v0"
        self._values = values
        self._pulse: Pulse | None = None

    def reset(self, n: int) -> None:
        """Nothing to forget: each batch is watched anew."""

    def watch(self, task: LimitingTask) -> None:
        """Make the tables of the episodes that have just begun, a tenth of a second each."""
        self._pulse = Pulse(table=PulseTables.of(_plants(task)), **self._values)
        self._pulse.reset(task.n)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve that was watched."""
        assert self._pulse is not None, "watch the episodes first"
        return self._pulse.act(observations)
