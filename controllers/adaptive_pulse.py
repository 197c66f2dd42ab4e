"""Adaptive pulse control: the pulse controller on a table that it fits to its valve from its own pulses.

A certainty-equivalent self-tuning regulator (Åström and Wittenmark, Adaptive Control, 2nd ed. 1995,
chapter 3): the plan treats the estimates as true, except for a lower aim while the opening pressure is
uncertain. Learnt are the opening pressure and the gain of a pulse (controllers/opening_bank.py), and the
venting rate of the control chamber from the fall of ln p3.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.opening_bank import BANK, OpeningBank, shifted
from controllers.opening_pressure import opening_pressure
from controllers.pulse_simulation import pulse_table
from controllers.pulse_table import PulseTable
from controllers.registration import CHEAP, Range, Registration
from epv_env.common.units import BAR
from epv_env.observation import decode


@dataclass(frozen=True, kw_only=True)
class VentingSettings:
    """How the venting rate is learnt."""

    spread: float = 0.2
    """Standard deviation of its factor before the first reading [1]: bore, chamber, contraction."""
    reading_error: float = 0.03
    """Standard deviation of p3 over p3 of a reading [1]."""
    drift: float = 1e-3
    """Growth of the factor's deviation with each reading [1]."""
    periods_after_release: int = 3
    """Control periods with the coil off from which p3 falls at its full rate: the armature has moved."""
    limits: tuple[float, float] = (0.4, 2.5)
    """Least and greatest factor [1]."""


VENTING = VentingSettings()


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
    filter_time: float
    """Time in which the weight of a reading of p2 fades by 1/e [s]."""
    look_ahead: float
    """Share of the time to open over which p2 is extrapolated [1]."""
    rounding: float
    """Remaining time below which a pulse ends now [control periods]."""
    control_period: float = 5e-3
    """[s]"""
    name: str = "pulse, adaptive"
    environment: str = "EPValve-v0"

    def __post_init__(self) -> None:
        if self.trigger >= self.aim:
            raise ValueError(
                f"trigger = {self.trigger:g} bar is not below aim = {self.aim:g} bar: a pulse only adds "
                "pressure, give trigger < aim"
            )
        self.reset(0)

    def reset(self, n: int) -> None:
        """Forget consumption and valves; n episodes begin."""
        self._bank = OpeningBank(n)
        self._pace = np.ones(n)  # venting rate over the table's
        self._pace_variance = np.full(n, VENTING.spread**2)
        self._error, self._slope = np.zeros((2, n))
        self._was_shut = np.zeros(n, dtype=bool)
        self._off_periods = np.zeros(n, dtype=np.int64)
        self._on_periods = np.zeros(n, dtype=np.int64)
        self._measuring = np.zeros(n, dtype=bool)
        self._at_end = np.zeros((4, n))  # p1, p2, p3 and slope when the pulse was ended

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        error, target, p1, p3, coil, p3_change = (
            decode(observations, name).astype(float)
            for name in ("p2_error", "target", "p1", "p3", "action", "p3_change_1")
        )
        p2_change = decode(observations, "p2_change_1").astype(float)
        p2, on = error + target, coil > 0.5
        self._off_periods = np.where(on, 0, self._off_periods + 1)
        self._on_periods = np.where(on, self._on_periods + 1, 0)
        self._watch_opening(p1, p2, p3, p2_change)
        table = shifted(self.table, self._bank.offset)
        opens_in = table.time_to_open(p1, p2, p3) / self._pace
        shut = opens_in > 0
        self._follow(error, shut)
        self._learn_venting(p3, p3_change, shut)
        self._learn_pulses(p2, on & shut)
        falls = np.minimum(self._slope, 0.0)

        ahead = self.look_ahead * (opens_in + self.table.release_lag)
        begins = shut & (self._error + falls * ahead < self.trigger)
        gain = self._bank.gain
        aim = self.aim - self.caution * self._bank.offset_deviation
        asked, slope = (aim - self._error) / gain, falls / (gain * self._pace)
        remaining = table.duration(p1, p2, p3, asked, slope) / self._pace
        ends = remaining < self.rounding * self.control_period
        action = np.where(on, np.where(begins, 0, 1), np.where(ends, 1, 0))
        ended = ~on & (action == 1)
        self._at_end = np.where(ended, np.stack([p1, p2, p3, falls]), self._at_end)
        self._measuring |= ended
        return action

    def _follow(self, error: NDArray, shut: NDArray) -> None:
        """Follow p2 - target (n,) [bar] and its slope while the valve is shut, as `Pulse` does."""
        fading = np.exp(-self.control_period / self.filter_time)
        expected = self._error + self._slope * self.control_period
        surprise = error - expected
        follows = shut & self._was_shut
        self._error = np.where(follows, expected + (1 - fading**2) * surprise, error)
        growth = (1 - fading) ** 2 * surprise / self.control_period
        self._slope = self._slope + np.where(follows, growth, 0.0)
        self._was_shut = shut

    def _learn_venting(self, p3: NDArray, p3_change: NDArray, shut: NDArray) -> None:
        """Correct the pace by the fall of ln p3 (n,) where the chamber vents and the piston rests."""
        reads = shut & (self._off_periods >= VENTING.periods_after_release)
        fall = np.log(np.maximum(p3 - p3_change, 0.1) / np.maximum(p3, 0.1))
        nominal = self.table.vent_rate * self.control_period
        noise = 2 * (VENTING.reading_error / nominal) ** 2
        variance = self._pace_variance + VENTING.drift**2
        correction = np.where(reads, variance / (variance + noise), 0.0)
        pace = self._pace + correction * (fall / nominal - self._pace)
        self._pace = np.clip(pace, *VENTING.limits)
        self._pace_variance = np.where(reads, (1 - correction) * variance, self._pace_variance)

    def _watch_opening(self, p1: NDArray, p2: NDArray, p3: NDArray, p2_change: NDArray) -> None:
        """Tell the bank which valves open in a pulse; all (n,) [bar], p2_change over one period."""
        who = np.flatnonzero(self._off_periods > 1)
        if len(who):
            opening = opening_pressure(self.table.parameters, p1[who] * BAR, p2[who] * BAR) / BAR
            consumed = np.minimum(self._slope[who], 0.0) * self.control_period
            self._bank.watch(who, opening, p3[who], p2_change[who] - consumed)

    def _learn_pulses(self, p2: NDArray, shut_again: NDArray) -> None:
        """Give the bank the gain of each pulse after which the valve has just shut, p2 (n,) [bar].

        A pulse that is continued before is not measured: its end is another's beginning.
        """
        who = np.flatnonzero(self._measuring & shut_again & (self._on_periods > 1))
        if len(who):
            p1, before, p3, slope = self._at_end[:, who]
            lasted = self._on_periods[who] * self.control_period
            members = len(BANK.offsets)

            def each(values: NDArray) -> NDArray:
                return np.repeat(values, members)

            assumed = shifted(self.table, np.tile(BANK.offsets, len(who)))
            stay = np.zeros(members * len(who))
            foreseen = assumed.gained(each(p1), each(before), each(p3), stay).reshape(-1, members)
            self._bank.learn(who, foreseen, p2[who] - before - slope * lasted, lasted)
        self._measuring[who] = False
        self._measuring &= self._on_periods > 0


REGISTRATION = Registration(
    kind="pulse, adaptive",
    controller=AdaptivePulse,
    build=lambda values, plant: AdaptivePulse(
        table=pulse_table(plant.parameters, supply_voltage=plant.voltage), **values
    ),
    search_space={
        "trigger": Range(low=-0.3, high=0.1, least=-0.5, most=0.5),
        "aim": Range(low=-0.1, high=0.3, least=-0.5, most=0.5),
        "caution": Range(low=0.0, high=0.6, most=2.0),
        "filter_time": Range(low=0.004, high=0.04, log=True, least=0.001, most=0.4),
        "look_ahead": Range(low=0.3, high=1.5, least=0.0, most=4.0),
        "rounding": Range(low=0.2, high=1.2, least=0.0, most=2.0),
    },
    cost=CHEAP,
)
