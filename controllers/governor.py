"""What corrects a learned policy by what is learnt about its valve, whoever asks the policy.

A learner of the valve (controllers/valve_learner.py) estimates how long the valve takes to open, how
low p2 will be then, and how far a pulse under way may still raise p2. The governor moves the policy's
setpoint by the first (a reference governor: Garone, Di Cairano and Kolmanovsky, Automatica 75 (2017)),
holds back needless pulses by the second, and ends pulses by the third. A pulse of a valve that is hardly
known ends before it may rise too far, so the first pulses probe when the valve opens; in an emergency
that nears the band's lower end none is ended. After a near miss, a breakdown deep into the band, p2 is
held higher and fewer pulses are held back.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.breakdown_memory import BreakdownMemory
from controllers.pulse_table import PulseTable
from controllers.reserve import expected_breakdown, reserve_for
from controllers.supervisor_settings import SETTINGS, SupervisorSettings
from controllers.valve_learner import LearntValve, ValveLearner
from epv_env.observation import INDEX, LAYOUT

ERROR = INDEX["p2_error"]
SLOW = 0.1
"""Reserve from which a valve is so slow that no pulse may wait [bar]."""
DEEP = 0.1
"""Breakdown beyond `near_miss` from which no pulse may wait [bar]."""
UNKNOWN_DEVIATION = 0.45
"""Standard deviation of the opening pressure above which a valve is unknown [bar]: hardly less than
before the first pulse (controllers/opening_bank.py)."""
UNKNOWN_CONFIDENCE = 0.99
"""`SupervisorSettings.confidence` of such a valve [1]: it is known better after a pulse, so that this
costs hardly any switchings."""
LARGE = 0.4
"""Rise from which the gain is doubted more, twice as much at double this rise: small pulses do not tell
how long a valve stays open whose control chamber is empty [bar]."""
URGENT_DEPTH = 0.35
"""Shortfall from which no pulse is ended while p2 falls faster than `URGENT_FALL` [bar]: the band's end
is near, and a valve that opens later than feared would lose the time to vent again."""
URGENT_FALL = 1.0
"""Fall of p2 that makes such a shortfall urgent [bar/s]: without consumption there is time to probe."""


@dataclass(frozen=True, kw_only=True)
class Advice:
    """The corrections of n valves in this control period."""

    shift: NDArray
    """How much lower the policy is shown p2 (n,) [bar]."""
    must_shut: NDArray
    """Whether the coil has to be on, bool (n,)."""
    margin: NDArray
    """By how much the logit of switching off must exceed that of leaving on (n,) [1]."""


def lowered(observations: NDArray, shift: NDArray) -> NDArray:
    """A copy of observations (n, entries or more) whose p2 is lower by `shift` (n,) [bar]."""
    shown = observations.copy()
    shown[:, ERROR] -= (shift / LAYOUT[ERROR].scale).astype(shown.dtype)
    return shown


class Governor:
    """Advises in every control period: `advise` before the decisions, `decided` after them."""

    def __init__(
        self, table: PulseTable, settings: SupervisorSettings = SETTINGS, *, control_period: float
    ):
        """
        Args:
            table: of the nominal plant.
            settings: of the supervisor.
            control_period: [s].
        """
        self._table, self._settings, self._control_period = table, settings, control_period
        self._learner = ValveLearner(
            table, filter_time=settings.filter_time, control_period=control_period
        )
        self._breakdowns = BreakdownMemory(
            memory_time=settings.memory_time, control_period=control_period
        )
        self.reset(0)

    def reset(self, n: int) -> None:
        """Forget the valves; n episodes begin."""
        self._learner.reset(n)
        self._breakdowns.reset(n)
        self._ended = np.zeros(n, dtype=bool)

    def forget(self, who: NDArray) -> None:
        """Forget the valves with these indices (m,), whose episodes have ended."""
        self._learner.forget(who)
        self._breakdowns.forget(who)
        self._ended[who] = False

    def arrays(self) -> Iterator[tuple[str, Any, str]]:
        """Name, owner and attribute of each array that is kept between control periods."""
        yield "ended", self, "_ended"
        yield from self._learner.arrays()
        yield from self._breakdowns.arrays()

    def advise(self, observations: NDArray) -> Advice:
        """Take in observations (n, entries or more); the corrections for them."""
        valve = self._learner.observe(observations)
        reserve = self.reserve(valve)
        deepest = self._breakdowns.observe(valve.error, valve.fed)
        too_deep = np.maximum(deepest - self._settings.near_miss, 0.0)
        return Advice(
            shift=self.shift(valve, reserve, too_deep), must_shut=self._must_shut(valve),
            margin=self._margin(valve, reserve, too_deep),
        )  # fmt: skip

    def decided(self, actions: NDArray) -> None:
        """Take in what has been decided (n,)."""
        self._learner.decided(actions)

    def reserve(self, valve: LearntValve) -> NDArray:
        """Reserve that each valve needs (n,) [bar]: the more, the less is known about it."""
        expected = expected_breakdown(self._table, valve.opens_from_rest)
        doubtful = self._settings.wariness * valve.offset_deviation
        return reserve_for(expected + doubtful, self._settings.tolerated)

    def shift(self, valve: LearntValve, reserve: NDArray, too_deep: NDArray) -> NDArray:
        """How much higher p2 is held (n,) [bar]; none while the supply cannot raise it.

        Args:
            valve: what is known of each.
            reserve: that each needs (n,) [bar].
            too_deep: by how much the deepest breakdown lately exceeds a near miss (n,) [bar].
        """
        settings = self._settings
        higher = settings.height + settings.share * reserve + settings.near_miss_share * too_deep
        return np.where(valve.fed, higher, 0.0)

    def _margin(self, valve: LearntValve, reserve: NDArray, too_deep: NDArray) -> NDArray:
        """How clearly a pulse has to be wanted (n,) [1]: a slow valve may hesitate less, and one that
        let p2 break down deep."""
        slow, deep = np.clip(reserve / SLOW, 0.0, 1.0), np.clip(too_deep / DEEP, 0.0, 1.0)
        needless = np.maximum(valve.forecast() - self._settings.free_below, 0.0)
        return self._settings.reluctance * needless * (1 - slow) * (1 - deep) * valve.on

    def _must_shut(self, valve: LearntValve) -> NDArray:
        """Whether the coil has to be on, bool (n,): no supply, a pulse that would rise too far, or one
        that was ended for this and is not measured yet, since nothing new is known about the valve.
        In an emergency that nears the band's lower end no pulse is ended."""
        too_far = self._rises_too_far(valve)
        self._ended = (self._ended & self._learner.measuring) | (too_far & ~valve.on)
        urgent = (valve.error < -URGENT_DEPTH) & (valve.fall < -URGENT_FALL)
        return ~valve.fed | ((too_far | self._ended) & ~urgent)

    def _rises_too_far(self, valve: LearntValve) -> NDArray:
        """Whether p2 passes the ceiling if the valve opens early and stays open for a period (n,)."""
        settings = self._settings
        unknown = valve.offset_deviation > UNKNOWN_DEVIATION
        early = self._learner.earliest(np.where(unknown, UNKNOWN_CONFIDENCE, settings.confidence))
        fall_of_log_p3 = self._table.vent_rate * valve.pace * self._control_period
        p3 = valve.p3 * np.where(valve.on, 1.0, np.exp(-fall_of_log_p3))
        may_be_open = early.time_to_open(valve.p1, valve.p2, p3) <= 0
        who = np.flatnonzero(valve.fed & may_be_open)
        rise = early.of(who).gained_at_once(valve.p1[who], valve.p2[who], p3[who])
        doubt = settings.doubt * (1 + np.clip(rise / LARGE - 1, 0.0, 1.0))
        gain = valve.gain[who] + doubt * valve.gain_deviation[who]
        highest = valve.error[who] + valve.fall[who] * settings.horizon + gain * rise
        too_far = np.zeros(len(p3), dtype=bool)
        too_far[who] = highest > settings.ceiling
        return too_far
