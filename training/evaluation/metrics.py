"""The control aims as figures, per episode and over many: C1 to C3 are defined here and nowhere else.

C1  p2 stays within target ±500 mbar after the settling time: constraint violation rate, worst
    excursion, and the excursion that 99.9 % of the episodes do not exceed.
C2  p2 breaks down little when air is drawn, and recovers soon: breakdown and recovery of every
    consumption event, largest shortfall of the episode.
C3  the same figures on plants drawn from a region.
Cost: switchings of the coil, air vented, coil energy.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from epv_env.reward import BAND_BAR
from training.evaluation.statistics import mean_interval

TAIL_SHARE = 0.999
"""Share of the episodes that do not exceed the tail excursion [1]."""


SHORTFALL_BAR = BAND_BAR / 2
"""Shortfall below the target from which a breakdown counts as not yet recovered [bar]."""
EVENT_FLOW = 0.9
"""Consumption above which a period belongs to an application [g/s]; the largest leak lies below."""
ONSET = 0.5
"""Time after an event's beginning within which a dip counts as its answer, for the recovery [s]."""
AFTERMATH = 1.0
"""Time after the end of its consumption for which a shortfall is still the event's [s]."""


class ConsumptionEvents:
    """Accumulates the events of n episodes, period by period, in constant memory.

    An event begins with the period in which consumption rises above EVENT_FLOW. It ends where the next
    one begins, or AFTERMATH after consumption has fallen below again, or with the episode. Its breakdown
    is the largest shortfall in that time. Its recovery is the time from its beginning until p2 is back
    above target - SHORTFALL_BAR after the first dip below, or to the event's end if that comes first;
    0 if no dip begins within ONSET.
    """

    def __init__(self, n: int, period: float):
        """n: number of episodes. period: control period [s]."""
        self._period = period
        self._open = np.zeros(n, dtype=bool)
        self._consuming = np.zeros(n, dtype=bool)
        self._age = np.zeros(n)
        self._quiet = np.zeros(n)
        self._depth = np.zeros(n)
        self._recovery = np.zeros(n)
        self._recovered = np.zeros(n, dtype=bool)
        self._count = np.zeros(n)
        self._depths = np.zeros(n)
        self._recoveries = np.zeros(n)
        self._longest = np.zeros(n)

    def update(self, consumption: NDArray, shortfall: NDArray) -> None:
        """Take in one period: mean consumption [g/s] and largest shortfall, 0 or more [bar], (n,)."""
        consuming = consumption > EVENT_FLOW
        begins = consuming & ~self._consuming
        self._consuming = consuming
        self._close(begins)
        self._open |= begins
        self._count += begins

        self._age += self._period
        self._quiet = np.where(consuming, 0.0, self._quiet + self._period)
        self._depth = np.maximum(self._depth, shortfall)
        answer = (self._recovery > 0) | (self._age <= ONSET)
        low = (shortfall > SHORTFALL_BAR) & answer & ~self._recovered
        self._recovered |= ~low & (self._recovery > 0)
        self._recovery = np.where(low, self._age, self._recovery)
        self._close(self._quiet >= AFTERMATH)

    def _close(self, where: NDArray) -> None:
        """End the events among `where` that are open, and forget what was gathered there."""
        ended = where & self._open
        self._depths += ended * self._depth
        self._recoveries += ended * self._recovery
        self._longest = np.where(ended, np.maximum(self._longest, self._recovery), self._longest)
        self._open &= ~where
        for figure in (self._age, self._depth, self._recovery):
            figure[where] = 0.0
        self._recovered[where] = False

    def result(self) -> dict[str, NDArray]:
        """The figures of events in EpisodeMetrics, (n,), so far; events under way end here."""
        count = np.maximum(self._count, 1)
        under_way = self._open
        return {
            "events": self._count.copy(),
            "event_breakdown_bar": (self._depths + under_way * self._depth) / count,
            "event_recovery_s": (self._recoveries + under_way * self._recovery) / count,
            "longest_event_recovery_s": np.maximum(self._longest, under_way * self._recovery),
        }


@dataclass(frozen=True, kw_only=True)
class EpisodeMetrics:
    """One entry per episode, arrays (n,). Pressures count after the settling time."""

    stayed: NDArray
    """C1: whether p2 never left target ±500 mbar."""
    excursion_bar: NDArray
    """C1: largest |p2 - target|, at any instant."""
    breakdown_bar: NDArray
    """C2: largest shortfall of p2 below the target."""
    recovery_s: NDArray
    """C2: longest time on end with p2 more than 250 mbar below the target."""
    events: NDArray
    """C2: number of consumption events."""
    event_breakdown_bar: NDArray
    """C2: breakdown of an event, mean over the episode's events; 0 without any."""
    event_recovery_s: NDArray
    """C2: recovery of an event, mean over the episode's events; 0 without any."""
    longest_event_recovery_s: NDArray
    """C2: longest recovery of an event."""
    rms_bar: NDArray
    """Root mean square of each period's largest deviation."""
    switchings_per_s: NDArray
    """Coil switchings per second, from the start to the episode's end."""
    vented_g_per_s: NDArray
    """Air blown off per second, from the start to the episode's end."""
    coil_W: NDArray
    """Mean electrical power of the coil, the integral of U I over time, up to the episode's end."""
    episode_return: NDArray
    """Sum of rewards."""

    def __len__(self) -> int:
        return len(self.stayed)

    def first(self, n: int) -> "EpisodeMetrics":
        """The first n episodes."""
        return EpisodeMetrics(**{f.name: getattr(self, f.name)[:n] for f in fields(self)})

    @classmethod
    def joined(cls, parts: Sequence["EpisodeMetrics"]) -> "EpisodeMetrics":
        """The episodes of all parts, one after another."""
        return cls(
            **{f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)}
        )


class Meter:
    """Accumulates the metrics of n episodes, period by period, in constant memory.

    An episode ends with the period in which its circuit empties: that period counts, with its one charge
    for the failure, and no later one does.
    """

    def __init__(self, n: int, period: float, settling_time: float):
        """
        Args:
            n: number of episodes.
            period: control period [s].
            settling_time: time from which pressures count [s].
        """
        self._period = period
        self._settling_time = settling_time
        self._steps = 0
        self._periods = np.zeros(n, dtype=np.int64)
        self._counted = np.zeros(n, dtype=np.int64)
        self._highest = np.full(n, -np.inf)
        self._lowest = np.full(n, np.inf)
        self._squares = np.zeros(n)
        self._low_time = np.zeros(n)
        self._longest_low = np.zeros(n)
        self._switchings = np.zeros(n)
        self._vented = np.zeros(n)
        self._return = np.zeros(n)
        self._failed = np.zeros(n, dtype=bool)
        self._events = ConsumptionEvents(n, period)

    def update(self, reward: NDArray, failed: NDArray, info: dict[str, NDArray]) -> None:
        """Take in one period of every episode.

        Args:
            reward: (n,).
            failed: whether the circuit has emptied (n,), bool.
            info: arrays (n,) by name (epv_env.result).
        """
        self._steps += 1
        runs = self.running
        self._periods += runs
        self._switchings += np.where(runs, info["switchings"], 0)
        self._vented += np.where(runs, info["vented_g"], 0.0)
        self._return += np.where(runs, reward, 0.0)
        self._failed |= failed
        if self._steps * self._period <= self._settling_time:
            return
        self._counted += runs
        deviation = np.where(runs, info["deviation_bar"], 0.0)
        self._highest = np.maximum(self._highest, deviation)
        self._lowest = np.minimum(self._lowest, deviation)
        self._squares += deviation**2
        self._low_time = np.where(deviation < -SHORTFALL_BAR, self._low_time + self._period, 0.0)
        self._longest_low = np.maximum(self._longest_low, self._low_time)
        consumption = np.where(runs, info["consumption_g_per_s"], 0.0)
        self._events.update(consumption, np.maximum(-deviation, 0.0))

    @property
    def running(self) -> NDArray:
        """Whether an episode goes on, its circuit not having emptied yet, boolean (n,)."""
        return ~self._failed

    def result(self, coil_energy: NDArray | float = 0.0) -> EpisodeMetrics:
        """The metrics so far.

        coil_energy: electrical energy of each coil from the start to its episode's end, (n,) [J].
        """
        excursion = np.maximum(self._highest, -self._lowest)
        time = self._periods * self._period
        return EpisodeMetrics(
            stayed=(excursion <= BAND_BAR) & ~self._failed,
            excursion_bar=excursion,
            breakdown_bar=np.maximum(-self._lowest, 0.0),
            recovery_s=self._longest_low,
            **self._events.result(),
            rms_bar=np.sqrt(self._squares / np.maximum(self._counted, 1)),
            switchings_per_s=self._switchings / time,
            vented_g_per_s=self._vented / time,
            coil_W=np.broadcast_to(coil_energy, excursion.shape) / time,
            episode_return=self._return,
        )


def violation_interval(stayed: NDArray) -> tuple[float, float]:
    """Exact 95 % interval (Clopper and Pearson 1934) of the constraint violation rate.

    The interval is two-sided, so its upper end is a 97.5 % bound. Without any violation this bound lies
    below 0.1 % from 3688 episodes on.

    stayed: whether an episode stayed within the band (n,), bool.
    """
    violations = len(stayed) - int(np.sum(stayed))
    interval = binomtest(violations, len(stayed)).proportion_ci(0.95, "exact")
    return float(interval.low), float(interval.high)


def tail_excursion(excursion_bar: NDArray) -> float:
    """Excursion that 99.9 % of n episodes do not exceed [bar]; of fewer than 1000 the worst.

    excursion_bar: of each episode (n,) [bar].
    """
    return float(np.quantile(excursion_bar, TAIL_SHARE, method="inverted_cdf"))


def over_events(m: EpisodeMetrics, mean: NDArray) -> float:
    """Mean of a figure over all events. mean: the mean over each episode's events (n,)."""
    return float(np.sum(mean * m.events) / max(np.sum(m.events), 1))


def summary(m: EpisodeMetrics) -> dict[str, float]:
    """The aims over many episodes; intervals are 95 %, exact for shares, by bootstrap for means."""
    violations = violation_interval(m.stayed)
    breakdown = mean_interval(m.breakdown_bar)
    return {
        "episodes": len(m),
        "C1_stayed": float(m.stayed.mean()),
        "C1_stayed_low": 1.0 - violations[1],
        "C1_stayed_high": 1.0 - violations[0],
        "C1_worst_excursion_bar": float(m.excursion_bar.max()),
        "C1_tail_excursion_bar": tail_excursion(m.excursion_bar),
        "C2_largest_breakdown_bar": float(m.breakdown_bar.max()),
        "C2_mean_breakdown_bar": float(m.breakdown_bar.mean()),
        "C2_mean_breakdown_low_bar": breakdown[0],
        "C2_mean_breakdown_high_bar": breakdown[1],
        "C2_longest_recovery_s": float(m.recovery_s.max()),
        "C2_events": int(m.events.sum()),
        "C2_event_breakdown_bar": over_events(m, m.event_breakdown_bar),
        "C2_event_recovery_s": over_events(m, m.event_recovery_s),
        "C2_longest_event_recovery_s": float(m.longest_event_recovery_s.max()),
        "rms_error_bar": float(np.sqrt(np.mean(m.rms_bar**2))),
        "switchings_per_s": float(m.switchings_per_s.mean()),
        "vented_g_per_s": float(m.vented_g_per_s.mean()),
        "coil_W": float(m.coil_W.mean()),
        "mean_return": float(m.episode_return.mean()),
    }
