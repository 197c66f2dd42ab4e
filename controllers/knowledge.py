"""What a policy is told about its valves beside the readings, and the rules that stand in front of it.

The learnt quantities come from the valve learner (controllers/valve_learner.py), the advice from the
adaptive pulse (controllers/pulse.py). Two rules keep the coil on, whatever the policy asks for:

1. The supply cannot raise p2: its pressure is less than LEAST_HEAD above the circuit's. A valve that
   stood open would let p2 follow a refill of the supply far above the target.
2. p2 might rise too far: if the valve opened early, p2 would pass the target by more than CEILING.

Three shields stand in front of the policy. Two turn what an ordinary episode shows into what no reading
can change, the third is for a valve that was off:

3. p2 as read lies above the band: coil on. It stands in front of whatever decides, the controller that
   takes over where sensors fail included.
4. p2 as read lies below the band, the supply is high and nothing is under way, since the coil is on and
   the control chamber full: coil off, unless a rule above says on. One period off cannot open the valve.
5. The first reading shows an empty control chamber: coil on for SHUTTING, whatever decides. The valve is
   open and nothing is known of it, and only consumption takes back what p2 rises too far.

A policy's file names the rules it was trained behind. The shields take no part in a training.
"""

from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numba
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from controllers.base import DIGEST, Controller, compiled, composed
from controllers.pulse import follow, nominal_knowledge
from controllers.valve_learner import LEARNT, LEAST_HEAD, VALVE
from epv_env.observation import ENTRIES, READINGS, read, scaled
from epv_env.plant.plantfile import Plant
from epv_env.plant.primitives import generated
from epv_env.reward import BAND_BAR

CEILING = 0.2
"""p2 - target that a pulse may reach if the valve opens early [bar]."""
RULES = ("supply cannot raise p2: coil on", "early opening would raise p2 too far: coil on")
"""The rules in front of a policy, as its file names them."""
SHIELDS = (
    "p2 above the band: coil on", "p2 below the band and nothing under way: coil off",
    "control chamber empty at first: coil on for 50 ms",
)  # fmt: skip
"""What stands in front of every policy beside its rules."""
HIGH_HEAD, FULL = 1.0, 0.5
"""p1 - p2 from which the supply is high, and p1 - p3 up to which the control chamber is full [bar]."""
HORIZON = 0.1
"""Time over which consumption lowers p2 there [s]: an overshoot in an emergency does not last."""

INPUTS = ENTRIES + len(LEARNT)
"""Of a policy: the observation, and the learnt quantities behind it."""


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


@compiled
def keeps_on(v):
    """Whether a rule keeps the coil on."""
    return cannot_raise(v) or would_rise_too_far(v)


@compiled
def above_band(error):
    """Shield 3: whether p2 - target as read [bar] lies above the band."""
    return error >= BAND_BAR


@compiled
def below_band(v, error):
    """Shield 4: whether p2 - target as read [bar] lies below the band, and the valve can be opened."""
    return error <= -BAND_BAR and v.on > 0 and v.head >= HIGH_HEAD and v.p1 - v.p3 <= FULL


@compiled
def forced(v, error):
    """What rules and shields force for p2 - target as read [bar]: 1 coil on, -1 coil off, 0 nothing;
    2 coil on, whatever decides."""
    if above_band(error) or v.found_open > 0:
        return 2.0
    if keeps_on(v):
        return 1.0
    return -1.0 if below_band(v, error) else 0.0


show_learnt: Any = generated(
    "show_learnt",
    "v, inputs",
    "; ".join(
        f"inputs[{ENTRIES + k}] = scaled(v.{q.name}, {q.centre}, {q.scale}, {q.limit})"
        for k, q in enumerate(LEARNT)
    ),
    compiled,
    scaled=scaled,
)
"""Write the learnt quantities of one valve behind the observation, into inputs (all,) [-]."""


@composed
def describe(v, r, observation, c, period, inputs):
    """Learn from the readings of one valve, and write all that a policy sees into inputs (all,) [-].

    c: a Knowledge.
    """
    follow(v, r, observation, c, period)
    for i in range(ENTRIES):
        inputs[i] = observation[i]
    show_learnt(v, inputs)


def _loop(digest: str) -> Any:
    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def describe_all(valves, observations, c, period, inputs, kept_on):
        if digest == "":
            return
        readings = np.zeros(1, READINGS)[0]
        for i in range(len(valves)):
            read(readings, observations[i])
            describe(valves[i], readings, observations[i], c, period, inputs[i])
            kept_on[i] = keeps_on(valves[i])

    return describe_all


_describe_all = _loop(DIGEST)


class ValveKnowledge:
    """Observations with the learnt quantities behind the readings, and what the rules forbid."""

    def __init__(self, plant: Plant, *, control_period: float = 5e-3):
        """plant: the nominal plant. control_period: [s]."""
        self._constants, self._period = nominal_knowledge(plant), control_period
        self.reset(0)

    def reset(self, n: int) -> None:
        """Forget the valves; n episodes begin."""
        self.valves = np.zeros(n, VALVE)
        """What is known of each valve, records (n,)."""
        self._kept_on = np.zeros(n, dtype=bool)

    def forget(self, who: NDArray) -> None:
        """Forget the valves of these episodes, indices (m,): others begin in their place."""
        self.valves[who] = 0

    def observe(self, observations: NDArray) -> NDArray:
        """Take in observations (n, entries); returns them with the learnt quantities (n, all)."""
        return self._described(self.valves, observations, self._kept_on)

    def overruled(self, actions: NDArray) -> NDArray:
        """Actions (n,) as the rules leave them, for the observations taken in last."""
        return np.where(self._kept_on, 1, actions)

    def last(self, who: NDArray, observations: NDArray) -> NDArray:
        """What `observe` gives for the last observations (m, entries) of episodes `who` (m,) that end;
        their valves are forgotten."""
        ending = self.valves[who]
        self.forget(who)
        return self._described(ending, observations, np.zeros(len(who), dtype=bool))

    def _described(self, valves: NDArray, observations: NDArray, kept_on: NDArray) -> NDArray:
        inputs = np.empty((len(observations), INPUTS), dtype=np.float32)
        seen = np.ascontiguousarray(observations, dtype=np.float32)
        _describe_all(valves, seen, self._constants, self._period, inputs, kept_on)
        return inputs


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
            self.knowledge.forget(np.flatnonzero(mask))
        self._done = np.zeros(self.num_envs, dtype=bool)
        return self.knowledge.observe(observations), infos

    def step(self, actions: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray, dict[str, Any]]:
        """Advance by one control period. Observations (n, all)."""
        if self._rules:
            actions = self.knowledge.overruled(actions)
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        if self._mode is AutoresetMode.NEXT_STEP:
            self.knowledge.forget(np.flatnonzero(self._done))
        self._done = terminated | truncated
        ended = np.flatnonzero(self._done)
        if self._mode is AutoresetMode.SAME_STEP and len(ended):
            last = np.stack([infos["final_obs"][i] for i in ended])
            for i, shown in zip(ended, self.knowledge.last(ended, last), strict=True):
                infos["final_obs"][i] = shown
        return self.knowledge.observe(observations), rewards, terminated, truncated, infos


WITH_RULES = " with rules"
"""Follows the name of a controller that stands behind the rules."""


@dataclass(kw_only=True)
class WithRules:
    """A controller of the on/off environment behind the rules."""

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
        return self._knowledge.overruled(self.main.act(observations))


def with_rules(controller: Controller, plant: Plant) -> WithRules:
    """The controller behind the rules, on a nominal plant. Raises ValueError for other actions."""
    if controller.environment != "EPValve-v0":
        raise ValueError(
            f"{controller.name!r} is for {controller.environment}: the rules keep the coil on, give a "
            "controller for EPValve-v0"
        )
    return WithRules(main=controller, plant=plant)
