"""Consumption events: how far p2 breaks down when air begins to be drawn, and how soon it is back."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.reward import BAND_BAR

SHORTFALL_BAR = BAND_BAR / 2
"""Shortfall from which a breakdown counts as not yet recovered."""

EVENT_G_PER_S = 0.9
"""Consumption above which a period belongs to an application; the largest leak lies below."""

ONSET_S = 0.5
"""How long after an event's beginning a dip still counts as its answer, for the recovery."""

AFTERMATH_S = 1.0
"""How long after its consumption has ceased a shortfall is still the event's."""


@dataclass(frozen=True, kw_only=True)
class EventFigures:
    """Figures of every episode's events, arrays (n,); 0 for an episode without any."""

    count: NDArray
    mean_breakdown: NDArray
    """[bar]"""
    mean_recovery: NDArray
    """[s]"""
    longest_recovery: NDArray
    """[s]"""


class ConsumptionEvents:
    """Accumulates the events of n episodes, period by period, in constant memory.

    An event begins with the period in which consumption rises above EVENT_G_PER_S and ends where the
    next one begins, or AFTERMATH_S after consumption has fallen below again, or with the episode. Its
    breakdown is the largest shortfall in that time. Its recovery is the time from its beginning until
    p2 is back above target - SHORTFALL_BAR after the first dip below, or to the event's end if that
    comes first; 0 if no dip begins within ONSET_S.
    """

    def __init__(self, n: int, period: float):
        """period: control period [s]."""
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
        consuming = consumption > EVENT_G_PER_S
        begins = consuming & ~self._consuming
        self._consuming = consuming
        self._close(begins)
        self._open |= begins
        self._count += begins

        self._age += self._period
        self._quiet = np.where(consuming, 0.0, self._quiet + self._period)
        self._depth = np.maximum(self._depth, shortfall)
        answer = (self._recovery > 0) | (self._age <= ONSET_S)
        low = (shortfall > SHORTFALL_BAR) & answer & ~self._recovered
        self._recovered |= ~low & (self._recovery > 0)
        self._recovery = np.where(low, self._age, self._recovery)
        self._close(self._quiet >= AFTERMATH_S)

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
