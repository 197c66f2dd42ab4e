"""The control aims as figures, per episode and over many: C1 to C3 are defined here and nowhere else.

C1  p2 stays within target ±500 mbar after the settling time: constraint violation rate, worst
    excursion, and the excursion that 99.9 % of the episodes do not exceed.
C2  p2 falls little when air is drawn, and recovers soon: pressure dip (`breakdown`) and recovery of
    every consumption event, largest shortfall of the episode.
C3  the same figures on plants drawn from a region.
Cost: switchings of the coil, air vented, coil energy.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from epv_env.plant.primitives import exact, source_digest
from epv_env.result import CONSUMPTION, DEVIATION, FAILED, REWARD, SWITCHINGS, VENTED
from epv_env.reward import BAND_BAR
from training.evaluation.statistics import mean_interval

TAIL_SHARE = 0.999
"""Share of the episodes that do not exceed the tail excursion [1]."""


SHORTFALL_BAR = BAND_BAR / 2
"""Shortfall below the target from which a pressure dip counts as not yet recovered [bar]."""
EVENT_FLOW = 0.9
"""Consumption above which a period belongs to an application [g/s]; the largest leak lies below."""
ONSET = 0.5
"""Time after an event's beginning within which a dip counts as its answer, for the recovery [s]."""
AFTERMATH = 1.0
"""Time after the end of its consumption for which a shortfall is still the event's [s]."""


METER = np.dtype((np.record, [(name, np.float64) for name in (
    "periods", "switchings", "vented", "coil_energy", "episode_return", "failed",
    "counted", "excursion", "breakdown", "squares", "low_time", "recovery",  # after the settling time
    "consuming", "open", "age", "quiet", "depth", "dip", "recovered",  # of the event under way
    "events", "depths", "recoveries", "longest",
)]))  # fmt: skip
"""What is counted of one episode [g, J, bar, s]; zeros: nothing yet."""


@exact
def count(m, figures, i, coil_energy, period, settling_time):
    """Take in one period of an episode, column i of its step's figures (epv_env/result.py).

    An episode ends with the period in which its circuit empties: that period counts, with its one charge
    for the failure, and no later one does. An accelerator compiles this function, too.

    m: a record of METER. coil_energy: of the coil so far [J]. period: control period [s]. settling_time:
    time from which pressures count [s].
    """
    if m.failed > 0.0:
        return
    m.periods += 1.0
    m.switchings += figures[SWITCHINGS, i]
    m.vented += 1e3 * figures[VENTED, i]
    m.coil_energy = coil_energy
    m.episode_return += figures[REWARD, i]
    m.failed = figures[FAILED, i]
    if m.periods * period <= settling_time:
        return
    deviation = figures[DEVIATION, i]
    shortfall = max(-deviation, 0.0)
    m.counted += 1.0
    m.excursion = max(m.excursion, abs(deviation))
    m.breakdown = max(m.breakdown, shortfall)
    m.squares += deviation * deviation
    m.low_time = m.low_time + period if shortfall > SHORTFALL_BAR else 0.0
    m.recovery = max(m.recovery, m.low_time)
    _follow_events(m, 1e3 * figures[CONSUMPTION, i] > EVENT_FLOW, shortfall, period)


@exact
def _follow_events(m, consuming, shortfall, period):
    """Take in whether a period belongs to an application, and its largest shortfall [bar].

    An event begins with the period in which consumption rises above EVENT_FLOW. It ends where the next
    one begins, or AFTERMATH after consumption has fallen below again, or with the episode. Its pressure
    dip is the largest shortfall in that time. Its recovery is the time from its beginning until p2 is
    back above target - SHORTFALL_BAR after the first dip below, or to the event's end if that comes
    first; 0 if no dip begins within ONSET.
    """
    if consuming and m.consuming == 0.0:
        _end_event(m)
        m.open = 1.0
        m.events += 1.0
    m.consuming = 1.0 if consuming else 0.0
    m.age += period
    m.quiet = 0.0 if consuming else m.quiet + period
    m.depth = max(m.depth, shortfall)
    low = shortfall > SHORTFALL_BAR and m.recovered == 0.0 and (m.dip > 0.0 or m.age <= ONSET)
    if low:
        m.dip = m.age
    elif m.dip > 0.0:
        m.recovered = 1.0
    if m.quiet >= AFTERMATH:
        _end_event(m)


@exact
def _end_event(m):
    """Add the event under way, if there is one, to the others."""
    if m.open > 0.0:
        m.depths += m.depth
        m.recoveries += m.dip
        m.longest = max(m.longest, m.dip)
    m.open = m.age = m.depth = m.dip = m.recovered = 0.0


def _loop(digest: str) -> Any:
    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def count_all(meters, figures, coil_energy, period, settling_time):
        if digest == "":
            return
        for i in range(len(meters)):
            count(meters[i], figures, i, coil_energy[i], period, settling_time)

    return count_all


count_all = _loop(source_digest())
"""`count` of n episodes: meters (n,), figures (N_FIGURE, n), coil_energy (n,)."""


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
    """C2: pressure dip of an event, mean over the episode's events; 0 without any."""
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

    @classmethod
    def of(cls, m: NDArray, period: float) -> "EpisodeMetrics":
        """Of records of METER (n,); events under way end here. period: control period [s]."""
        time, events = m["periods"] * period, np.maximum(m["events"], 1)
        return cls(
            stayed=(m["excursion"] <= BAND_BAR) & (m["failed"] == 0),
            excursion_bar=m["excursion"],
            breakdown_bar=m["breakdown"],
            recovery_s=m["recovery"],
            events=m["events"],
            event_breakdown_bar=(m["depths"] + m["open"] * m["depth"]) / events,
            event_recovery_s=(m["recoveries"] + m["open"] * m["dip"]) / events,
            longest_event_recovery_s=np.maximum(m["longest"], m["open"] * m["dip"]),
            rms_bar=np.sqrt(m["squares"] / np.maximum(m["counted"], 1)),
            switchings_per_s=m["switchings"] / time,
            vented_g_per_s=m["vented"] / time,
            coil_W=m["coil_energy"] / time,
            episode_return=m["episode_return"],
        )

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
