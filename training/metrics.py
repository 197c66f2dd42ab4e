"""The control aims as figures, per episode: C1 excursion, C2 breakdown, and what control costs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.reward import BAND_BAR

SHORTFALL_BAR = BAND_BAR / 2
"""Shortfall from which a breakdown counts as not yet recovered."""


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
    rms_bar: NDArray
    """Root mean square of each period's largest deviation."""
    switchings_per_s: NDArray
    """Coil switchings per second, whole episode."""
    vented_g_per_s: NDArray
    """Air blown off per second, whole episode."""
    episode_return: NDArray
    """Sum of rewards."""


class Meter:
    """Accumulates the metrics of n episodes, period by period, in constant memory."""

    def __init__(self, n: int, period: float, settling_time: float):
        """period: control period [s]; settling_time: from when pressures count [s]."""
        self._period = period
        self._settling_time = settling_time
        self._steps = 0
        self._counted = 0
        self._highest = np.full(n, -np.inf)
        self._lowest = np.full(n, np.inf)
        self._squares = np.zeros(n)
        self._low_time = np.zeros(n)
        self._longest_low = np.zeros(n)
        self._switchings = np.zeros(n)
        self._vented = np.zeros(n)
        self._return = np.zeros(n)
        self._failed = np.zeros(n, dtype=bool)

    def update(self, reward: NDArray, failed: NDArray, info: dict[str, NDArray]) -> None:
        """Take in one period of every episode (epv_env.infos)."""
        self._steps += 1
        self._switchings += info["switchings"]
        self._vented += info["vented_g"]
        self._return += reward
        over = self._failed.copy()  # what comes after a failure means nothing
        self._failed |= failed
        if self._steps * self._period <= self._settling_time:
            return
        self._counted += 1
        deviation = np.where(over, 0.0, info["deviation_bar"])
        self._highest = np.maximum(self._highest, deviation)
        self._lowest = np.minimum(self._lowest, deviation)
        self._squares += deviation**2
        self._low_time = np.where(deviation < -SHORTFALL_BAR, self._low_time + self._period, 0.0)
        self._longest_low = np.maximum(self._longest_low, self._low_time)

    def result(self) -> EpisodeMetrics:
        """The metrics so far."""
        excursion = np.maximum(self._highest, -self._lowest)
        time = self._steps * self._period
        return EpisodeMetrics(
            stayed=(excursion <= BAND_BAR) & ~self._failed,
            excursion_bar=excursion,
            breakdown_bar=np.maximum(-self._lowest, 0.0),
            recovery_s=self._longest_low,
            rms_bar=np.sqrt(self._squares / max(self._counted, 1)),
            switchings_per_s=self._switchings / time,
            vented_g_per_s=self._vented / time,
            episode_return=self._return,
        )
