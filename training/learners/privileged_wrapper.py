"""What training knows and no ECU measures: the critic's view of an episode, and the charge for leaving.

Only the critic reads the entries that this wrapper appends (asymmetric actor-critic: Pinto et al., RSS
2018). They hold the true state, the plant's parameters and the consumption that is to come. The
consumption does not depend on the actions, so a critic that foresees it takes the luck of the draw out
of the advantages and leaves them unbiased (input-dependent baselines: Mao et al., ICLR 2019).
"""

from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from epv_env.common.units import BAR, GRAM
from epv_env.observation import decode
from epv_env.plant.consumption import totals
from epv_env.plant.equations import State
from epv_env.sb3 import SB3VectorEnv
from epv_env.task import LimitingTask

MECHANICS, FLAGS = 7, 2
"""Entries of the true state, and of what has happened in the episode."""


FORESIGHT = np.array([0, 4, 8, 14, 22, 32, 50, 80, 140, 240])
"""Ends of the intervals whose mean consumption is foreseen [control periods from now]."""
FLOW = 2.0 * GRAM
"""Consumption that is shown as 1 [kg/s]."""
DEVIATION = 0.1
"""Relative deviation of a parameter from the region's centre that is shown as 1 [1]."""


class PrivilegedWrapper(VecEnvWrapper):
    """Scaled rewards with a charge for leaving, and observations that end with the critic's view."""

    def __init__(
        self,
        env: VecEnv,
        *,
        scale: float,
        charge: float,
        margin_bar: float,
        longest: int,
    ):
        """
        Args:
            env: n episodes, made with `privileged=True`.
            scale: factor of the rewards [1].
            charge: price of an episode that leaves the band in training, once.
            margin_bar: deviation from the target, after the settling time, that counts as leaving [bar].
                An episode that begins below the band leaves it only once it has reached it.
            longest: control periods of the longest episode.
        """
        assert isinstance(env.unwrapped, SB3VectorEnv)
        self._env = env.unwrapped
        self._task: LimitingTask = env.get_attr("task")[0]
        settings = self._task.settings
        region = settings.plants
        self._symbols = [
            row for row, symbol in enumerate(region.centre) if symbol in (*region.boxes, *region.symbols)
        ]
        self._centre = np.array(list(region.centre.values()))[self._symbols]
        self._scale, self._charge, self._margin_bar = scale, charge, margin_bar
        self._settled = round(settings.settling_time / settings.control_period)
        self._times = np.arange(longest + FORESIGHT[-1] + 1) * settings.control_period
        n = env.num_envs
        self.left = np.zeros(n, dtype=bool)
        """Whether the episode has been charged (n,)."""
        self.reached = np.zeros(n, dtype=bool)
        """Whether the episode has reached the band with its margin (n,)."""
        self._taken = np.zeros((n, len(self._times)))
        space = env.observation_space
        assert isinstance(space, Box)
        more = np.full(self._entries, np.inf, dtype=np.float32)
        low, high = np.append(space.low, -more), np.append(space.high, more)
        super().__init__(env, observation_space=Box(low, high, dtype=np.float32))

    @property
    def _entries(self) -> int:
        """Number of entries that are appended."""
        return MECHANICS + len(self._symbols) + len(FORESIGHT) - 1 + FLAGS

    def reset(self) -> VecEnvObs:
        """First observations (n, entries + more)."""
        observation = self.venv.reset()
        self.foresee(np.arange(self.num_envs))
        return self._shown(observation)

    def step_wait(self) -> VecEnvStepReturn:
        """Observations (n, entries + more), scaled rewards (n,), ends (n,) and infos."""
        before = self._task.steps.copy()
        observation, reward, done, infos = self.venv.step_wait()
        ended = np.flatnonzero(done).tolist()
        deviation = self._env.last_infos["deviation_bar"].copy()
        deviation[ended] = [infos[i]["deviation_bar"] for i in ended]
        self.reached |= deviation >= -self._margin_bar
        outside = (np.abs(deviation) > self._margin_bar) & (before >= self._settled)
        leaves = outside & self.reached & ~self.left
        self.left |= leaves
        for i in ended:
            infos[i]["terminal_observation"] = self._last(i, before[i] + 1, infos[i])
        self.left[ended] = self.reached[ended] = False
        self.foresee(np.array(ended, dtype=int))
        return self._shown(observation), self._scale * (reward - self._charge * leaves), done, infos

    def foresee(self, who: NDArray) -> None:
        """Take note of the consumption of the episodes `who`, which have just begun."""
        if len(who):
            self._taken[who] = totals(self._task.consumption.progress[who], self._times)

    def _shown(self, observation: VecEnvObs) -> NDArray:
        """Observations of all episodes with the critic's view."""
        assert isinstance(observation, np.ndarray)
        state, values = self._task.valves.state, self._task.parameter_values
        every = np.arange(self.num_envs)
        return self._joined(observation, state, values, every, self._task.steps)

    def _last(self, i: int, steps: int, info: dict[str, Any]) -> NDArray:
        """The last observation of episode i, which ended after `steps`, with the critic's view."""
        state = State(*info["true_state"][:, None])
        seen, values = info["terminal_observation"][None], info["parameters"][None]
        return self._joined(seen, state, values, np.array([i]), np.array([steps]))[0]

    def _joined(
        self, observation: NDArray, state: State, values: NDArray, who: NDArray, steps: NDArray
    ) -> NDArray:
        """Observations (m, entries) of the episodes `who` (m,) with the critic's view of them."""
        error = state.p2 / BAR - decode(observation, "target")
        mechanics = np.stack(
            [
                state.p1 / (10 * BAR) - 1, error / 0.5, state.p3 / (4 * BAR) - 2,
                state.p2 / (4 * BAR) - 2, 2e3 * state.xMV, 1e3 * state.xPV, state.I / 0.3 - 1,
            ],
            axis=1,
        )  # fmt: skip
        plant = (values[:, self._symbols] / self._centre - 1) / DEVIATION
        ahead = steps[:, None] + FORESIGHT
        taken = np.take_along_axis(self._taken[who], np.minimum(ahead, len(self._times) - 1), axis=1)
        lengths = np.diff(FORESIGHT) * self._task.period
        flows = np.diff(taken, axis=1) / lengths / FLOW
        rest = np.stack([self.left[who], np.minimum(steps / self._settled, 1.1)], axis=1)
        return np.concatenate([observation, mechanics, plant, flows, rest], axis=1).astype(np.float32)
