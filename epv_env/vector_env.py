"""EPValve-v0 and EPValvePWM-v0 as native vector environments: n valves in one compiled batch."""

from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from epv_env.actions import PWM, OnOff
from epv_env.common.field_types import shown
from epv_env.observation import observation_space
from epv_env.result import KEYS, StepResult, step_info, truth
from epv_env.settings import as_plant, checked_options, make_settings, with_options
from epv_env.signals import OptionError, as_seed, check_count, checked_flag
from epv_env.task import LimitingTask

BATCH = (
    "num_envs", "max_episode_steps", "autoreset_mode", "threads", "device", "to_host", "starts",
)  # fmt: skip
"""What a batch takes beside the arguments of one environment; the last three: `make_vector`."""


def masked_info(result: StepResult, valid: NDArray) -> dict[str, Any]:
    """`step_info` with Gymnasium's masks; zeros where not valid (n,), in steps that begin an episode."""
    infos = step_info(result)
    if not valid.all():
        infos = {key: np.where(valid, value, 0).astype(value.dtype) for key, value in infos.items()}
    return infos | {f"_{key}": valid for key in KEYS}


def keep_final(infos: dict[str, Any], observation: NDArray, ended: NDArray) -> None:
    """Move what a step shows of the episodes that ended (n,) to "final_info" and "final_obs"."""
    final = {key: value for key, value in infos.items() if not key.startswith("_")}
    infos["final_obs"] = np.full(len(ended), None, dtype=object)
    for i in np.flatnonzero(ended):
        infos["final_obs"][i] = observation[i]
    infos["final_info"] = {}
    for key, value in final.items():
        infos["final_info"][key] = np.where(ended, value, 0).astype(value.dtype)
        infos["final_info"][f"_{key}"] = ended
        infos[key] = np.where(ended, 0, value).astype(value.dtype)
        infos[f"_{key}"] = ~ended
    infos["_final_obs"] = infos["_final_info"] = ended


class _ValveVectorEnv(gymnasium.vector.VectorEnv):
    """n environments side by side, each exactly as it would be alone.

    Sub-environment i, seeded with seed + i as in SyncVectorEnv, gives the same trajectory to the bit as
    the single environment with that seed. Arguments as for the single environment, and:
        num_envs: number of valves.
        max_episode_steps: control periods after which an episode is truncated, one number for all or
            one for each sub-environment; None: never.
        autoreset_mode: an AutoresetMode or its value. NEXT_STEP is Gymnasium's default, SAME_STEP is
            what stable-baselines3 needs, DISABLED leaves resets to options={"reset_mask": mask}.
        threads: threads of the plant; None uses every core.
        privileged: whether infos show true state and parameters, as for the single environment.
    reset(options=...): as for the single environment; a list gives one value for each
    sub-environment, None standing for the constructor's.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012
    action_form: ClassVar[type[OnOff] | type[PWM]]
    most_envs: ClassVar[int] = 1_000_000
    """More are a slip, and would fill the memory."""

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int | list[int] | tuple[int, ...] | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        plant: Any = None,
        control_period: float | None = None,
        threads: int | None = None,
        privileged: bool = False,
        render_mode: str | None = None,
        **options: Any,
    ):
        check_count("num_envs", num_envs, most=self.most_envs)
        if threads is not None:
            check_count("threads", threads)
        if render_mode is not None:
            raise OptionError("the vector environment does not render: use gymnasium.make instead")
        self.autoreset_mode = _checked_mode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        period = self.action_form.default_period if control_period is None else control_period
        self.plant = as_plant(plant)
        self.settings = make_settings(self.plant, others=BATCH, control_period=period, **options)
        self.num_envs = num_envs
        self.max_episode_steps: Any = _checked_limit(max_episode_steps, num_envs)
        self.render_mode = None
        self.action = self.action_form(period)
        self.single_action_space = self.action.space()
        self.single_observation_space = observation_space()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.task = LimitingTask(self._on_host(num_envs), self.settings, threads=threads)
        self.privileged = checked_flag("privileged", privileged)
        self._rngs = [np_random(None)[0] for _ in range(self.task.n)]
        self._done = np.zeros(num_envs, dtype=bool)
        self._some_done = False
        self._every = np.ones(num_envs, dtype=bool)

    def _on_host(self, num_envs: int) -> int:
        """Episodes that the host keeps."""
        return num_envs

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[NDArray, dict[str, Any]]:
        """Start all episodes, or those of options["reset_mask"] (n,) bool."""
        options = checked_options(options)
        mask = self._checked_mask(options.pop("reset_mask", self._every))
        seeds = self._seeds(seed)
        where = np.flatnonzero(mask)
        for i in where:
            if seeds[i] is not None:
                self._rngs[i] = np_random(seeds[i])[0]
        return self._begin(where, options), self._truth()

    def step(self, actions: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray, dict[str, Any]]:
        stale = self._done
        if self.autoreset_mode is AutoresetMode.DISABLED and self._some_done:
            raise OptionError(
                f"sub-environment {np.flatnonzero(stale)[0]} has ended: reset it with "
                "options={'reset_mask': mask} before the next step"
            )
        result = self.advance(actions)
        observation, reward, terminated = result.observation, result.reward, result.failed
        limit = np.inf if self.max_episode_steps is None else self.max_episode_steps
        truncated = self.task.steps >= limit
        valid = self._every.copy()
        if self.autoreset_mode is AutoresetMode.NEXT_STEP and self._some_done:
            observation = self._begin(np.flatnonzero(stale), {})
            reward, terminated, truncated = (
                np.where(stale, 0, value).astype(value.dtype)
                for value in (reward, terminated, truncated)
            )
            valid = ~stale
        infos = masked_info(result, valid)
        self._done = terminated | truncated
        self._some_done = bool(self._done.any())
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._some_done:
            observation = self._restart(observation, infos)
        return observation, reward, terminated, truncated, infos | self._truth()

    def advance(self, actions: NDArray) -> StepResult:
        """One control period of every valve (n,), whether its episode has ended or not."""
        return self.task.step(*self.action.decode(actions))

    @property
    def coil_energy(self) -> NDArray:
        """Electrical energy of each coil so far, (n,) [J]."""
        return self.task.valves.state.coil_energy

    def _truth(self) -> dict[str, Any]:
        """The privileged entries of info, if they are shown; they belong to the observations shown."""
        if not self.privileged:
            return {}
        shown = truth(self.task.valves.state, self.task.parameter_values)
        return shown | {f"_{key}": self._every.copy() for key in shown}

    def _restart(self, observation: NDArray, infos: dict[str, Any]) -> NDArray:
        """Begin the ended episodes anew within the step that ended them."""
        ended = self._done
        keep_final(infos, observation, ended)
        for key, value in self._truth().items():
            infos["final_info"][key] = ended if key.startswith("_") else value
        return self._begin(np.flatnonzero(ended), {})

    def _begin(self, where: NDArray, options: dict[str, Any]) -> NDArray:
        """Start the episodes at `where` and return all observations."""
        settings = [self.settings] * len(where)
        if options:
            settings = [with_options(self.settings, self._chosen(i, options), self.plant) for i in where]
        self._done = self._done.copy()
        self._done[where] = False
        self._some_done = bool(self._done.any())
        return self.task.begin(where, [self._rngs[i] for i in where], settings)

    def _chosen(self, i: int, options: dict[str, Any]) -> dict[str, Any]:
        """The options of sub-environment i: lists hold one value for each."""
        for key, value in options.items():
            if isinstance(value, list) and len(value) != self.num_envs:
                raise OptionError(
                    f"option {key} lists {len(value)} values for {self.num_envs} environments: "
                    "give one each, or one (low, high) tuple for all"
                )
        chosen = {k: value[i] if isinstance(value, list) else value for k, value in options.items()}
        return {key: value for key, value in chosen.items() if value is not None}

    def _seeds(self, seed: Any) -> list[int | None]:
        """One seed for each sub-environment, as SyncVectorEnv gives them."""
        if not isinstance(seed, (list, tuple, range)) and np.ndim(seed) == 0:
            first = as_seed(seed)
            return [None if first is None else first + i for i in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise OptionError(f"got {len(seed)} seeds for {self.num_envs} environments: give one each")
        return [as_seed(value) for value in seed]

    def _checked_mask(self, mask: NDArray) -> NDArray:
        if not isinstance(mask, np.ndarray) or mask.shape != (self.num_envs,) or mask.dtype != bool:
            raise OptionError(f"reset_mask must be a boolean array of shape ({self.num_envs},)")
        if not mask.any():
            raise OptionError("reset_mask selects no environment: set at least one True")
        return mask


def _checked_mode(mode: Any) -> AutoresetMode:
    """The mode, from itself or its value. Raises OptionError."""
    known = [mode.value for mode in AutoresetMode]
    if isinstance(mode, AutoresetMode) or (isinstance(mode, str) and mode in known):
        return AutoresetMode(mode)
    raise OptionError(f"autoreset_mode = {shown(mode)}: give one of {', '.join(known)}")


def _checked_limit(limit: Any, n: int) -> Any:
    """The greatest number of steps: None, a number for all, or an array (n,). Raises OptionError."""
    if limit is None:
        return None
    listed = isinstance(limit, (list, tuple))
    for steps in limit if listed else [limit]:
        check_count("max_episode_steps", steps)
    if not listed:
        return limit
    if len(limit) != n:
        raise OptionError(
            f"max_episode_steps lists {len(limit)} numbers for {n} environments: give one each, or one "
            "for all"
        )
    return np.array(limit)


class EPValveVectorEnv(_ValveVectorEnv):
    __doc__ = (_ValveVectorEnv.__doc__ or "") + "Actions: MultiDiscrete, 0 = coil off, 1 = on."
    action_form = OnOff


class EPValvePWMVectorEnv(_ValveVectorEnv):
    __doc__ = (_ValveVectorEnv.__doc__ or "") + "Actions: Box [-1, 1], (n, 1), see EPValvePWMEnv."
    action_form = PWM
