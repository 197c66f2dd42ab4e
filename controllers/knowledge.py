"""What a policy is told about its valves beside the readings, and the rules that stand in front of it.

The learnt quantities come from the valve learner (controllers/valve_learner.py), the advice from the
adaptive pulse (controllers/pulse.py). Two rules keep the coil on, whatever the policy asks for:

1. The supply cannot raise p2: its pressure is less than LEAST_HEAD above the circuit's. A valve that
   stood open would let p2 follow a refill of the supply far above the target.
2. p2 might rise too far: if the valve opened early, p2 would pass the target by more than CEILING.
"""

from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numba
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from controllers.base import Controller
from controllers.pulse import PLAN, PulsePlan, plan
from controllers.pulse_table import compiled, nominal_table
from controllers.valve_learner import DIGEST, LEAST_HEAD, ValveLearner
from epv_env.observation import LAYOUT, Quantity
from epv_env.plant.plantfile import Plant

CEILING = 0.2
"""p2 - target that a pulse may reach if the valve opens early [bar]."""
RULES = ("supply cannot raise p2: coil on", "early opening would raise p2 too far: coil on")
"""The rules in front of a policy, as its file names them."""
HORIZON = 0.1
"""Time over which consumption lowers p2 there [s]: an overshoot in an emergency does not last."""


def _learnt() -> tuple[Quantity, ...]:
    def quantity(name: str, unit: str, scale: float, limit: float, centre: float = 0.0) -> Quantity:
        return Quantity(name=name, unit=unit, centre=centre, scale=scale, limit=limit)

    return (
        quantity("offset", "bar", 0.5, 8.0),
        quantity("offset_deviation", "bar", 0.5, 8.0),
        quantity("gain", "1", 0.2, 8.0, centre=1.0),
        quantity("gain_deviation", "1", 0.2, 8.0),
        quantity("pace", "1", 0.2, 8.0, centre=1.0),
        quantity("pace_deviation", "1", 0.2, 8.0),
        quantity("error", "bar", 0.5, 4.0),
        quantity("fall", "bar/s", 2.0, 4.0),
        quantity("opens_in", "s", 0.05, 2.0),
        quantity("opens_in_early", "s", 0.05, 2.0),
        quantity("opens_from_rest", "s", 0.05, 2.0, centre=0.05),
        quantity("forecast", "bar", 0.5, 4.0),
        quantity("under_way", "bar", 0.3, 4.0),
        quantity("after_period", "bar", 0.3, 4.0),
        quantity("after_period_early", "bar", 0.3, 4.0),
        quantity("reserve", "bar", 0.1, 4.0),
        quantity("deepest", "bar", 0.25, 4.0),
        quantity("head", "bar", 2.0, 2.0),
        quantity("margin", "bar", 0.2, 2.0),
        quantity("remaining", "s", 0.02, 2.0),
        quantity("advised", "1", 0.5, 1.0, centre=0.5),
    )


LEARNT = _learnt()
"""The learnt quantities, the advice last; controllers.valve_learner.VALVE says what they mean."""
READINGS = len(LAYOUT)
"""Number of the readings, which come first."""
_CENTRE, _SCALE, _LIMIT = (
    np.array([getattr(quantity, name) for quantity in LEARNT]) for name in ("centre", "scale", "limit")
)


@compiled
def shown(value, k):
    """The k-th learnt quantity as a policy sees it [-]."""
    return min(max((value - _CENTRE[k]) / _SCALE[k], -_LIMIT[k]), _LIMIT[k])


@compiled
def describe(v, out):
    """Write the learnt quantities of one valve into out (readings + learnt quantities,)."""
    out[READINGS + 0] = shown(v.offset, 0)
    out[READINGS + 1] = shown(v.offset_deviation, 1)
    out[READINGS + 2] = shown(v.gain, 2)
    out[READINGS + 3] = shown(v.gain_deviation, 3)
    out[READINGS + 4] = shown(v.pace, 4)
    out[READINGS + 5] = shown(v.pace_deviation, 5)
    out[READINGS + 6] = shown(v.error, 6)
    out[READINGS + 7] = shown(v.fall, 7)
    out[READINGS + 8] = shown(v.opens_in, 8)
    out[READINGS + 9] = shown(v.opens_in_early, 9)
    out[READINGS + 10] = shown(v.opens_from_rest, 10)
    out[READINGS + 11] = shown(v.forecast, 11)
    out[READINGS + 12] = shown(v.under_way, 12)
    out[READINGS + 13] = shown(v.after_period, 13)
    out[READINGS + 14] = shown(v.after_period_early, 14)
    out[READINGS + 15] = shown(v.reserve, 15)
    out[READINGS + 16] = shown(v.deepest, 16)
    out[READINGS + 17] = shown(v.head, 17)
    out[READINGS + 18] = shown(v.margin, 18)
    out[READINGS + 19] = shown(v.remaining, 19)
    out[READINGS + 20] = shown(v.advised, 20)


@compiled
def cannot_raise(v):
    """Rule 1: whether the supply cannot raise the circuit."""
    return v.head <= LEAST_HEAD


@compiled
def would_rise_too_far(v):
    """Rule 2: whether an early opening within the next period would raise p2 too far."""
    if v.after_period_early <= 0:
        return False
    return v.error + v.fall * HORIZON + v.after_period_early > CEILING


def _loop(digest: str) -> Any:
    """Advice, learnt quantities and rules of a batch of valves."""

    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def describe_all(valves, table, p, period, out, must_shut):
        if digest == "":
            return
        for i in range(len(valves)):
            plan(valves[i], table, 0, p, period)
            describe(valves[i], out[i])
            must_shut[i] = cannot_raise(valves[i]) or would_rise_too_far(valves[i])

    return describe_all


_describe_all = _loop(DIGEST)


class ValveKnowledge:
    """Observations with the learnt quantities behind the readings, and what the rules forbid."""

    def __init__(self, plant: Plant, *, control_period: float = 5e-3, pulse: PulsePlan = PLAN):
        """
        Args:
            plant: the nominal plant.
            control_period: [s].
            pulse: how the advice is planned.
        """
        self.learner = ValveLearner(nominal_table(plant), control_period=control_period)
        self._pulse = pulse
        self.must_shut = np.zeros(0, dtype=bool)
        """Whether a rule keeps the coil on (n,)."""

    def reset(self, n: int) -> None:
        """Forget the valves; n episodes begin."""
        self.learner.reset(n)
        self.must_shut = np.zeros(n, dtype=bool)

    def observe(self, observations: NDArray) -> NDArray:
        """Take in observations (n, readings); returns them with the learnt quantities (n, all)."""
        return self._described(self.learner.observe(observations), observations, self.must_shut)

    def last(self, who: NDArray, observations: NDArray) -> NDArray:
        """What `observe` gives for the last observations (m, entries) of episodes `who` (m,) that end;
        the learner forgets these valves."""
        ending = ValveLearner(self.learner.table, control_period=self.learner.control_period)
        ending.valves = self.learner.valves[who]
        self.learner.forget(who)
        return self._described(ending.observe(observations), observations, np.zeros(len(who), bool))

    def _described(self, valves: Any, observations: NDArray, must_shut: NDArray) -> NDArray:
        out = np.empty((len(observations), READINGS + len(LEARNT)), dtype=np.float32)
        out[:, :READINGS] = observations
        table, period = self.learner.table, self.learner.control_period
        _describe_all(valves, table, self._pulse, period, out, must_shut)
        return out


class LearntObservation(VectorWrapper):
    """EPValve-v0 as a vector environment whose observations end with the learnt quantities.

    env = LearntObservation(gymnasium.make_vec("EPValve-v0", num_envs=64))
    """

    def __init__(self, env: VectorEnv, *, plant: Plant | None = None, rules: bool = False):
        """
        Args:
            env: n valves of EPValve-v0, in any autoreset mode.
            plant: the nominal plant that the learner starts from; None: the environment's.
            rules: whether the rules overrule the actions.
        """
        super().__init__(env)
        own: Any = env.unwrapped
        self._mode = own.metadata["autoreset_mode"]
        self.knowledge = ValveKnowledge(
            own.plant if plant is None else plant, control_period=own.settings.control_period
        )
        self._rules = rules
        self._done = np.zeros(env.num_envs, dtype=bool)
        space: Any = env.single_observation_space
        more = np.full(len(LEARNT), np.inf, dtype=np.float32)
        self.single_observation_space = gymnasium.spaces.Box(
            np.append(space.low, -more), np.append(space.high, more), dtype=np.float32
        )
        self.observation_space = batch_space(self.single_observation_space, env.num_envs)

    def reset(self, *, seed: Any = None, options: Any = None) -> tuple[NDArray, dict[str, Any]]:
        """Start all episodes, or those of options["reset_mask"]. Observations (n, all)."""
        mask = (options or {}).get("reset_mask")
        observations, infos = self.env.reset(seed=seed, options=options)
        if mask is None:
            self.knowledge.reset(self.num_envs)
        else:
            self.knowledge.learner.forget(np.flatnonzero(mask))
        self._done = np.zeros(self.num_envs, dtype=bool)
        return self.knowledge.observe(observations), infos

    def step(self, actions: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray, dict[str, Any]]:
        """Advance by one control period. Observations (n, all)."""
        if self._rules:
            actions = np.where(self.knowledge.must_shut, 1, actions)
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        if self._mode is AutoresetMode.NEXT_STEP:
            self.knowledge.learner.forget(np.flatnonzero(self._done))
        self._done = terminated | truncated
        ended = np.flatnonzero(self._done)
        if self._mode is AutoresetMode.SAME_STEP and len(ended):
            last = np.stack([infos["final_obs"][i] for i in ended])
            for i, shown in zip(ended, self.knowledge.last(ended, last), strict=True):
                infos["final_obs"][i] = shown
        return self.knowledge.observe(observations), rewards, terminated, truncated, infos


WITH_RULES = ", with rules"
"""Follows the name of a controller that stands behind the rules."""


@dataclass(kw_only=True)
class WithRules:
    """A controller of the on/off environment behind the two rules."""

    main: Controller
    """Decides where no rule does."""
    plant: Plant = field(repr=False)
    """The nominal plant."""
    control_period: float = 5e-3
    """[s]"""
    name: str = field(init=False)
    environment: str = "EPValve-v0"

    def __post_init__(self) -> None:
        self.name = self.main.name + WITH_RULES
        self._knowledge = ValveKnowledge(self.plant, control_period=self.control_period)

    def reset(self, n: int) -> None:
        """Forget the valves; n episodes begin."""
        self.main.reset(n)
        self._knowledge.reset(n)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        self._knowledge.observe(observations)
        return np.where(self._knowledge.must_shut, 1, self.main.act(observations))


def with_rules(controller: Controller, plant: Plant) -> WithRules:
    """The controller behind the rules, on a nominal plant. Raises ValueError for other actions."""
    if controller.environment != "EPValve-v0":
        raise ValueError(
            f"{controller.name!r} is for {controller.environment}: the rules keep the coil on, give a "
            "controller for EPValve-v0"
        )
    return WithRules(main=controller, plant=plant)
