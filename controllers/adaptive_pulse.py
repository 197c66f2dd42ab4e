"""Adaptive pulse control: the pulse controller on a table that it fits to its valve from its own pulses.

A self-tuning regulator (Åström and Wittenmark, Adaptive Control, 2nd ed. 1995, chapter 3): the plan
treats what the learner has found out (controllers/valve_learner.py) as true, with two corrections. It
aims lower by what is uncertain about the rise, and holds p2 higher where the valve is slow to open.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.pulse_simulation import nominal_table
from controllers.pulse_table import PulseTable
from controllers.registration import CHEAP, Range, Registration
from controllers.reserve import TOLERATED, reserve_of
from controllers.valve_learner import LearntValve, ValveLearner


@dataclass(kw_only=True)
class AdaptivePulse:
    """Plans pulses as `controllers.pulse.Pulse` does, on a table that follows the valve.

    The nominal table is kept. Its opening pressure is shifted, its time runs faster or slower with the
    control chamber's venting, and its gain is multiplied by the factor learnt.
    """

    table: PulseTable
    """Of the nominal plant."""
    trigger: float
    """Predicted p2 - target below which a pulse begins [bar]."""
    aim: float
    """p2 - target at which a pulse shall end [bar]."""
    caution: float
    """How much lower a pulse aims for each bar of the opening pressure's standard deviation [1]."""
    doubt: float
    """Standard deviations of the gain that a pulse allows for in what p2 will still rise [1]."""
    filter_time: float
    """Time in which the weight of a reading of p2 fades by 1/e [s]."""
    look_ahead: float
    """Share of the time to open over which p2 is extrapolated [1]."""
    rounding: float
    """Remaining time below which a pulse ends now [control periods]."""
    tolerated: float = TOLERATED
    """Expected breakdown that needs no reserve [bar]."""
    control_period: float = 5e-3
    """[s]"""
    name: str = "pulse, adaptive"
    environment: str = "EPValve-v0"
    _learner: ValveLearner = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.trigger >= self.aim:
            raise ValueError(
                f"trigger = {self.trigger:g} bar is not below aim = {self.aim:g} bar: a pulse only adds "
                "pressure, give trigger < aim"
            )
        self._learner = ValveLearner(
            self.table, filter_time=self.filter_time, control_period=self.control_period
        )

    def reset(self, n: int) -> None:
        """Forget consumption and valves; n episodes begin."""
        self._learner.reset(n)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        valve = self._learner.observe(observations)
        reserve = reserve_of(self.table, valve.opens_from_rest, self.tolerated)
        begins = valve.fed & valve.shut & (valve.forecast(self.look_ahead) < self.trigger + reserve)
        action = np.where(begins, 0, 1)
        off = np.flatnonzero(~valve.on)
        action[off] = np.where(self._ends(valve, reserve, off), 1, 0)
        self._learner.decided(action)
        return action

    def _ends(self, valve: LearntValve, reserve: NDArray, who: NDArray) -> NDArray:
        """Whether the pulses of the valves at these indices (m,) end now, bool."""
        gain, pace = valve.gain[who], valve.pace[who]
        aim = self.aim + reserve[who] - self._uncertainty(valve, who)
        asked, slope = (aim - valve.error[who]) / gain, valve.fall[who] / (gain * pace)
        at = valve.p1[who], valve.p2[who], valve.p3[who]
        remaining = valve.table.of(who).duration(*at, asked, slope) / pace
        return ~valve.fed[who] | (remaining < self.rounding * self.control_period)

    def _uncertainty(self, valve: LearntValve, who: NDArray) -> NDArray:
        """How much lower a pulse aims (m,) [bar]: two independent errors of the rise, together.

        Another opening pressure moves the rise of any pulse alike. Another gain counts by what p2 would
        still rise if the coil were switched on now: much, while the valve is wide open.
        """
        by_gain = self.doubt * valve.gain_deviation[who] * valve.under_way(who)
        return np.hypot(self.caution * valve.offset_deviation[who], by_gain)


REGISTRATION = Registration(
    kind="pulse, adaptive",
    controller=AdaptivePulse,
    build=lambda values, plant: AdaptivePulse(table=nominal_table(plant), **values),
    search_space={
        "trigger": Range(low=-0.3, high=0.1, least=-0.5, most=0.5),
        "aim": Range(low=-0.1, high=0.3, least=-0.5, most=0.5),
        "caution": Range(low=0.0, high=0.6, most=2.0),
        "doubt": Range(low=0.0, high=1.5, most=4.0),
        "filter_time": Range(low=0.004, high=0.04, log=True, least=0.001, most=0.4),
        "look_ahead": Range(low=0.3, high=1.5, least=0.0, most=4.0),
        "rounding": Range(low=0.2, high=1.2, least=0.0, most=2.0),
    },
    cost=CHEAP,
)
