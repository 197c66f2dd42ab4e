"""Consumption events: how far p2 breaks down when air is drawn, and how soon it recovers."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.reward import BAND_BAR


@dataclass(frozen=True, kw_only=True)
class EventSettings:
    """What counts as a consumption event and as recovered from it."""

    shortfall_bar: float = BAND_BAR / 2
    """Shortfall below the target from which a breakdown counts as not yet recovered [bar]."""
    flow_g_per_s: float = 0.9
    """Consumption above which a period belongs to an application [g/s]; the largest leak lies below."""
    onset_s: float = 0.5
    """Time after an event's beginning within which a dip counts as its answer, for the recovery [s]."""
    aftermath_s: float = 1.0
    """Time after the end of its consumption for which a shortfall is still the event's [s]."""


EVENTS = EventSettings()
"""Events as the comparison counts them."""


@dataclass(frozen=True, kw_only=True)
class EventFigures:
    """Figures of every episode's events, arrays (n,); 0 for an episode without any."""

    count: NDArray
    """Number of events."""
    mean_breakdown: NDArray
    """Mean over the events of the largest shortfall [bar]."""
    mean_recovery: NDArray
    """Mean over the events of the recovery time [s]."""
    longest_recovery: NDArray
    """Longest recovery time [s]."""


class ConsumptionEvents:
    """Accumulates the events of n episodes, period by period, in constant memory.

    An event begins with the period in which consumption rises above `flow_g_per_s`. It ends where the
    next one begins, or `aftermath_s` after consumption has fallen below again, or with the episode. Its
    breakdown is the largest shortfall in that time. Its recovery is the time from its beginning until
    p2 is back above target - `shortfall_bar` after the first dip below, or to the event's end if that
    comes first; 0 if no dip begins within `onset_s`.
    """

    def __init__(self, n: int, period: float, settings: EventSettings = EVENTS):
        """
        Args:
            n: number of episodes.
            period: control period [s].
            settings: what counts as an event.
        """
        self._period = period
        self._settings = settings
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
        consuming = consumption > self._settings.flow_g_per_s
        begins = consuming & ~self._consuming
        self._consuming = consuming
        self._close(begins)
        self._open |= begins
        self._count += begins

        self._age += self._period
        self._quiet = np.where(consuming, 0.0, self._quiet + self._period)
        self._depth = np.maximum(self._depth, shortfall)
        answer = (self._recovery > 0) | (self._age <= self._settings.onset_s)
        low = (shortfall > self._settings.shortfall_bar) & answer & ~self._recovered
        self._recovered |= ~low & (self._recovery > 0)
        self._recovery = np.where(low, self._age, self._recovery)
        self._close(self._quiet >= self._settings.aftermath_s)

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

    def result(self) -> EventFigures:
        """The figures so far; events under way end here."""
        count = np.maximum(self._count, 1)
        under_way = self._open
        return EventFigures(
            count=self._count.copy(),
            mean_breakdown=(self._depths + under_way * self._depth) / count,
            mean_recovery=(self._recoveries + under_way * self._recovery) / count,
            longest_recovery=np.maximum(self._longest, under_way * self._recovery),
        )
