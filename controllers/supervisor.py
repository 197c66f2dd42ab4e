"""A supervisor around a learned policy: it corrects the policy by what it learns about the valve.

A learner of the valve (controllers/valve_learner.py) estimates how long the valve takes to open, how
low p2 will be then, and how far a pulse under way may still raise p2. The supervisor moves the policy's
setpoint by the first (a reference governor: Garone, Di Cairano and Kolmanovsky, Automatica 75 (2017)),
holds back needless pulses by the second, and ends pulses by the third. A pulse of a valve that is hardly
known ends before it may rise too far, so the first pulses probe when the valve opens.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller, Graded, Privileged, with_period
from controllers.pulse_table import PulseTable
from controllers.reserve import TOLERATED, expected_breakdown, reserve_for
from controllers.valve_learner import LearntValve, ValveLearner
from epv_env.observation import INDEX, LAYOUT
from epv_env.reward import BAND_BAR

ERROR = INDEX["p2_error"]
SLOW = 0.1
"""Reserve from which a valve is so slow that no pulse may wait [bar]."""


@dataclass(frozen=True, kw_only=True)
class SupervisorSettings:
    """How a supervisor corrects its policy.

    Training settles `height`, `free_below` and `reluctance` for each policy
    (training/learners/supervision.py). The others were chosen by hand on development episodes.
    """

    height: float = 0.0
    """How much higher than the policy alone p2 is held at any valve [bar]."""
    free_below: float = 0.0
    """Forecast of p2 - target, for when the valve would open, up to which the policy alone decides
    whether a pulse begins [bar]."""
    reluctance: float = 0.0
    """For each bar of the forecast above that, by how much the policy's logit of switching off must
    exceed that of leaving on before a pulse begins [1/bar]: such a pulse is needed only if it is wanted
    clearly."""
    share: float = 0.5
    """Share of the reserve that a valve needs beyond that [1]: the policy keeps some by itself."""
    tolerated: float = TOLERATED
    """Expected breakdown that needs no reserve [bar]."""
    wariness: float = 0.15
    """Breakdown expected in addition for a bar of the opening pressure's standard deviation [1]."""
    ceiling: float = 0.15
    """p2 - target that a pulse may reach if the valve opens early, or else it ends [bar]."""
    confidence: float = 0.95
    """Probability that the valve opens no earlier than is allowed for there [1]."""
    doubt: float = 0.75
    """Standard deviations of the gain that are allowed for there [1]."""
    horizon: float = 0.1
    """Time over which consumption lowers p2 there [s]: an overshoot in an emergency does not last."""
    filter_time: float = 0.025
    """Time in which the weight of a reading of p2 fades by 1/e [s]."""

    def __post_init__(self) -> None:
        for name in ("height", "free_below"):
            if not abs(value := getattr(self, name)) <= BAND_BAR:
                raise ValueError(f"{name} = {value:g} bar: give one within ±{BAND_BAR:g} bar")
        for name in ("reluctance", "share", "wariness", "doubt", "horizon"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise ValueError(f"{name} = {getattr(self, name):g}: give a number from 0")
        if not 0 < self.confidence < 1:
            raise ValueError(f"confidence = {self.confidence:g}: give a number between 0 and 1")
        if not self.filter_time > 0:
            raise ValueError(f"filter_time = {self.filter_time:g} s: give a positive time")


SETTINGS = SupervisorSettings()


@dataclass(kw_only=True)
class Supervisor:
    """Lets `main` act on a setpoint that suits the valve, and ends what would rise too far."""

    main: Controller
    """For the on/off environment."""
    table: PulseTable
    """Of the nominal plant."""
    settings: SupervisorSettings = SETTINGS
    control_period: float = 5e-3
    """[s]"""
    name: str = field(init=False)
    environment: str = field(init=False)
    _learner: ValveLearner = field(init=False, repr=False)
    _ended: NDArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if isinstance(self.main, Privileged):
            raise ValueError(
                f"{self.main.name!r} reads no sensor: give a controller that acts on readings"
            )
        if self.main.environment != "EPValve-v0":
            raise ValueError(
                f"{self.main.name!r} is for {self.main.environment}: a supervisor ends pulses of the "
                "coil, give a controller for EPValve-v0"
            )
        self.main = with_period(self.main, self.control_period)
        self.name, self.environment = f"{self.main.name}, supervised", self.main.environment
        self._learner = ValveLearner(
            self.table, filter_time=self.settings.filter_time, control_period=self.control_period
        )

    def reset(self, n: int) -> None:
        """Forget the valves; n episodes begin."""
        self.main.reset(n)
        self._learner.reset(n)
        self._ended = np.zeros(n, dtype=bool)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        valve = self._learner.observe(observations)
        reserve = self.reserve(valve)
        shown = observations.copy()
        shown[:, ERROR] -= (self.shift(valve, reserve) / LAYOUT[ERROR].scale).astype(shown.dtype)
        action = np.where(self._must_shut(valve), 1, self._asked(shown, valve, reserve))
        self._learner.decided(valve, action)
        return action

    def _asked(self, shown: NDArray, valve: LearntValve, reserve: NDArray) -> NDArray:
        """What the policy asks for clearly (n,): the slower a valve, the less it may hesitate."""
        if not isinstance(self.main, Graded):
            return self.main.act(shown)
        logits = self.main.logits(shown)
        slow = np.clip(reserve / SLOW, 0.0, 1.0)
        needless = np.maximum(valve.forecast() - self.settings.free_below, 0.0)
        asked = self.settings.reluctance * needless * (1 - slow) * valve.on
        return np.where(logits[:, 1] - logits[:, 0] > -asked, 1, 0)

    def reserve(self, valve: LearntValve) -> NDArray:
        """Reserve that each valve needs (n,) [bar]: the more, the less is known about it."""
        expected = expected_breakdown(self.table, valve.opens_from_rest)
        doubtful = self.settings.wariness * valve.offset_deviation
        return reserve_for(expected + doubtful, self.settings.tolerated)

    def shift(self, valve: LearntValve, reserve: NDArray) -> NDArray:
        """How much higher p2 is held (n,) [bar]; none while the supply cannot raise it."""
        return np.where(valve.fed, self.settings.height + self.settings.share * reserve, 0.0)

    def _must_shut(self, valve: LearntValve) -> NDArray:
        """Whether the coil has to be on, bool (n,): no supply, a pulse that would rise too far, or one
        that was ended for this and is not measured yet, since nothing new is known about the valve."""
        too_far = self._rises_too_far(valve)
        self._ended = (self._ended & self._learner.measuring) | (too_far & ~valve.on)
        return ~valve.fed | too_far | self._ended

    def _rises_too_far(self, valve: LearntValve) -> NDArray:
        """Whether p2 passes the ceiling if the valve opens early and stays open for a period (n,)."""
        early = self._learner.earliest(self.settings.confidence)
        fall_of_log_p3 = self.table.vent_rate * valve.pace * self.control_period
        p3 = valve.p3 * np.where(valve.on, 1.0, np.exp(-fall_of_log_p3))
        may_be_open = early.time_to_open(valve.p1, valve.p2, p3) <= 0
        who = np.flatnonzero(valve.fed & may_be_open)
        gain = valve.gain[who] + self.settings.doubt * valve.gain_deviation[who]
        rise = gain * early.of(who).gained_at_once(valve.p1[who], valve.p2[who], p3[who])
        highest = valve.error[who] + valve.fall[who] * self.settings.horizon + rise
        too_far = np.zeros(len(p3), dtype=bool)
        too_far[who] = highest > self.settings.ceiling
        return too_far
