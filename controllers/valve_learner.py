"""What a valve's own pulses tell of it: opening pressure, gain of a pulse, and venting rate.

A table of the nominal plant is fitted to each valve (Åström and Wittenmark, Adaptive Control, 2nd ed.
1995, chapter 3). The opening pressure and the gain of a pulse are learnt by a bank of Kalman filters
(controllers/opening_bank.py), the venting rate of the control chamber from the fall of ln p3.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.opening_bank import BANK, OpeningBank, shifted
from controllers.opening_pressure import opening_pressure
from controllers.pulse_table import PulseTable
from controllers.reserve import fed
from epv_env.common.units import BAR
from epv_env.observation import decode


@dataclass(frozen=True, kw_only=True)
class VentingSettings:
    """How the venting rate is learnt."""

    spread: float = 0.2
    """Standard deviation of its factor before the first reading [1]: bore, chamber, contraction."""
    reading_error: float = 0.01
    """Standard deviation of p3 over p3 of a reading [1]."""
    drift: float = 1e-3
    """Growth of the factor's deviation with each reading [1]."""
    periods_after_release: int = 3
    """Control periods with the coil off from which p3 falls at its full rate: the armature has moved."""
    limits: tuple[float, float] = (0.4, 2.5)
    """Least and greatest factor [1]."""


VENTING = VentingSettings()


@dataclass(frozen=True, kw_only=True)
class LearntValve:
    """What is known of n valves in this control period; arrays (n,)."""

    table: PulseTable
    """With the learnt opening pressures."""
    pace: NDArray
    """Venting rate over the table's [1]: times of the table are divided by it."""
    gain: NDArray
    """Rise of p2 by a pulse over the table's [1]."""
    gain_deviation: NDArray
    """Standard deviation of the learnt gain [1]."""
    offset_deviation: NDArray
    """Standard deviation of the learnt opening pressure [bar]."""
    p1: NDArray
    """Supply pressure [bar]."""
    p2: NDArray
    """Circuit pressure as read [bar]."""
    p3: NDArray
    """Control pressure [bar]."""
    error: NDArray
    """p2 - target, filtered while the valve is shut [bar]."""
    fall: NDArray
    """Rate of change of p2 by consumption, at most 0 [bar/s]."""
    on: NDArray
    """Whether the coil is on, bool."""
    opens_in: NDArray
    """Time until the piston lifts, the coil being off from now [s]; 0: it is open."""

    @property
    def shut(self) -> NDArray:
        """Whether the piston rests on its seat, bool (n,)."""
        return self.opens_in > 0

    @property
    def opens_from_rest(self) -> NDArray:
        """`opens_in` with the control chamber full, at p1 (n,) [s]."""
        return self.table.time_to_open(self.p1, self.p2, self.p1) / self.pace

    def forecast(self, look_ahead: float = 1.0) -> NDArray:
        """p2 - target when the valve opens, if the coil is switched off now (n,) [bar].

        look_ahead: share of the time until then over which p2 is extrapolated [1].
        """
        return self.error + self.fall * (look_ahead * (self.opens_in + self.table.release_lag))

    def under_way(self, who: NDArray) -> NDArray:
        """What p2 of the valves at these indices (m,) still rises by the table if shut now [bar]."""
        return self.table.of(who).gained_at_once(self.p1[who], self.p2[who], self.p3[who])

    @property
    def fed(self) -> NDArray:
        """Whether the supply can raise the circuit, bool (n,)."""
        return fed(self.p1, self.p2)


class ValveLearner:
    """Follows n valves from their observations and learns what they are."""

    def __init__(self, table: PulseTable, *, filter_time: float, control_period: float):
        """
        Args:
            table: of the nominal plant.
            filter_time: time in which the weight of a reading of p2 fades by 1/e [s].
            control_period: [s].
        """
        self._nominal, self._filter_time, self._control_period = table, filter_time, control_period
        self.reset(0)

    def reset(self, n: int) -> None:
        """Forget consumption and valves; n episodes begin."""
        self._bank = OpeningBank(n)
        self._pace = np.ones(n)
        self._pace_variance = np.full(n, VENTING.spread**2)
        self._error, self._slope = np.zeros((2, n))
        self._was_shut = np.zeros(n, dtype=bool)
        self._off_periods = np.zeros(n, dtype=np.int64)
        self._on_periods = np.zeros(n, dtype=np.int64)
        self._measuring = np.zeros(n, dtype=bool)
        self._now, self._at_end = np.zeros((2, n, 4))  # p1, p2, p3, fall; the same as the pulse ended

    def forget(self, who: NDArray) -> None:
        """Forget consumption and valve of these episodes, indices (m,): others begin in their place."""
        new = ValveLearner(
            self._nominal, filter_time=self._filter_time, control_period=self._control_period
        )
        new.reset(len(who))
        for (_, mine, name), (_, fresh, _) in zip(self.arrays(), new.arrays(), strict=True):
            getattr(mine, name)[who] = getattr(fresh, name)

    def arrays(self) -> Iterator[tuple[str, Any, str]]:
        """Name, owner and attribute of each array (n, ...) that is kept between control periods."""
        for name in (
            "pace", "pace_variance", "error", "slope", "was_shut", "off_periods", "on_periods",
            "measuring", "now", "at_end",
        ):  # fmt: skip
            yield name, self, f"_{name}"
        yield from self._bank.arrays()

    def observe(self, observations: NDArray) -> LearntValve:
        """Take in observations (n, entries); what is known then."""
        error, target, p1, p3, coil, p3_change = (
            decode(observations, name).astype(float)
            for name in ("p2_error", "target", "p1", "p3", "action", "p3_change_1")
        )
        p2_change = decode(observations, "p2_change_1").astype(float)
        p2, on = error + target, coil > 0.5
        self._off_periods = np.where(on, 0, self._off_periods + 1)
        self._on_periods = np.where(on, self._on_periods + 1, 0)
        self._watch_opening(p1, p2, p3, p2_change)
        table = shifted(self._nominal, self._bank.offset)
        opens_in = table.time_to_open(p1, p2, p3) / self._pace
        shut = opens_in > 0
        self._follow(error, shut)
        self._learn_venting(p3, p3_change, shut)
        self._learn_pulses(p2, on & shut)
        fall = np.minimum(self._slope, 0.0)
        self._now = np.stack([p1, p2, p3, fall], axis=1)
        return LearntValve(
            table=table, pace=self._pace, gain=self._bank.gain, p1=p1, p2=p2, p3=p3,
            gain_deviation=self._bank.gain_deviation, offset_deviation=self._bank.offset_deviation,
            error=self._error, fall=fall, on=on, opens_in=opens_in,
        )  # fmt: skip

    def earliest(self, probability: float | NDArray) -> PulseTable:
        """The table of valves that open as early as the learnt ones may: earlier ones are improbable.

        probability: that a valve opens no earlier, a number or (n,).
        """
        return shifted(self._nominal, self._bank.offset_quantile(probability))

    @property
    def measuring(self) -> NDArray:
        """Whether the gain of the last pulse is still being measured, bool (n,)."""
        return self._measuring

    def decided(self, action: NDArray) -> None:
        """Take in the decisions (n,) of this period: the end of a pulse is measured later."""
        ended = (self._on_periods == 0) & (action == 1)
        self._at_end = np.where(ended[:, None], self._now, self._at_end)
        self._measuring |= ended

    def _follow(self, error: NDArray, shut: NDArray) -> None:
        """Follow p2 - target (n,) [bar] and its slope while the valve is shut, as `Pulse` does."""
        fading = np.exp(-self._control_period / self._filter_time)
        expected = self._error + self._slope * self._control_period
        surprise = error - expected
        follows = shut & self._was_shut
        self._error = np.where(follows, expected + (1 - fading**2) * surprise, error)
        growth = (1 - fading) ** 2 * surprise / self._control_period
        self._slope = self._slope + np.where(follows, growth, 0.0)
        self._was_shut = shut

    def _learn_venting(self, p3: NDArray, p3_change: NDArray, shut: NDArray) -> None:
        """Correct the pace by the fall of ln p3 (n,) where the chamber vents and the piston rests."""
        reads = shut & (self._off_periods >= VENTING.periods_after_release)
        fall = np.log(np.maximum(p3 - p3_change, 0.1) / np.maximum(p3, 0.1))
        nominal = self._nominal.vent_rate * self._control_period
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
            opening = opening_pressure(self._nominal.parameters, p1[who] * BAR, p2[who] * BAR) / BAR
            consumed = np.minimum(self._slope[who], 0.0) * self._control_period
            self._bank.watch(who, opening, p3[who], p2_change[who] - consumed)

    def _learn_pulses(self, p2: NDArray, shut_again: NDArray) -> None:
        """Give the bank the gain of each pulse after which the valve has just shut, p2 (n,) [bar].

        A pulse that is continued before is not measured: its end is another's beginning.
        """
        who = np.flatnonzero(self._measuring & shut_again & (self._on_periods > 1))
        if len(who):
            p1, before, p3, slope = self._at_end[who].T
            lasted = self._on_periods[who] * self._control_period
            members = len(BANK.offsets)

            def each(values: NDArray) -> NDArray:
                return np.repeat(values, members)

            assumed = shifted(self._nominal, np.tile(BANK.offsets, len(who)))
            foreseen = assumed.gained_at_once(each(p1), each(before), each(p3)).reshape(-1, members)
            self._bank.learn(who, foreseen, p2[who] - before - slope * lasted, lasted)
        self._measuring[who] = False
        self._measuring &= self._on_periods > 0
