"""Sensors that fail from an instant on: what a controller then reads."""

from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.observation import HISTORY, LAYOUT, P2_LAGS, P3_LAGS, decode, encode
from epv_env.plant.channels import CURRENT, P1, P2, P3

CHANNELS = {"p1": P1, "p2": P2, "p3": P3, "current": CURRENT}
FAULTS = ("stuck", "zero", "saturated", "wild", "delayed", "drifting", "swapped")
"""At its value; 0; at the sensor's end; uniform in its range in every period; late by DELAY periods;
off by DRIFT more every second, up or down; reading what another pressure sensor should (PARTNERS)."""
DELAY = 20
DRIFT = 0.03
"""Share of the sensor's range [1/s]: half a bar a second."""
PARTNERS = [2, 1, 0, 3]
"""Place of the channel that a swapped one reads: p3 for p1, and p1 for p3."""

Fault = tuple[str, str]
"""A channel and one of FAULTS."""


class SensorFaults:
    """The readings of n episodes, some of them wrong."""

    def __init__(self, cases: Sequence[Sequence[Fault]], begins: ArrayLike, rng: np.random.Generator):
        """
        Args:
            cases: faults of each episode, n of them.
            begins: periods after which they begin, one or (n,).
            rng: draws wild readings and the direction of a drift.
        """
        self._begins, self._rng, self._period = np.asarray(begins), rng, 0
        self._fault = np.full((len(cases), len(CHANNELS)), -1)
        for row, case in enumerate(cases):
            for channel, name in case:
                self._fault[row, list(CHANNELS).index(channel)] = FAULTS.index(name)
        ends = [each.sensor.constants()[3:] for each in CHANNELS.values()]
        self._low, self._high = np.transpose(ends)
        drift = DRIFT * (self._high - self._low)
        self._drift = drift * rng.choice([-1.0, 1.0], self._fault.shape)
        self._stuck = np.zeros(self._fault.shape)
        self._true: deque[NDArray] = deque(maxlen=DELAY + 1)
        self._read: deque[NDArray] = deque(maxlen=HISTORY)

    def shown(self, seen: NDArray, period: float) -> NDArray:
        """Observations (n, entries) as the failing sensors give them; `period`: control period [s]."""
        acts = (self._period >= self._begins) & (self._fault >= 0).any(axis=1)
        now = {entry.name: decode(seen, entry.name) for entry in LAYOUT}
        pressures = now["p1"], now["p2_error"] + now["target"], now["p3"]
        true = np.stack([*pressures, now["I"]], axis=1)
        self._true.append(true)
        self._stuck = np.where(acts[:, None], self._stuck, true)
        wild = self._rng.uniform(self._low, self._high, true.shape)
        late = np.maximum(self._period - self._begins, 0)[..., None] * period
        broken = [
            self._stuck, 0 * true, np.broadcast_to(self._high, true.shape), wild, self._true[0],
            np.clip(true + self._drift * late, self._low, self._high), true[:, PARTNERS],
        ]  # fmt: skip
        chosen = np.take_along_axis(np.stack(broken), np.maximum(self._fault, 0)[None], axis=0)[0]
        self._read.append(np.where((self._fault >= 0) & acts[:, None], chosen, true))
        self._period += 1
        return np.where(acts[:, None], self._encoded(now), seen)

    def _encoded(self, now: dict[str, NDArray]) -> NDArray:
        """The observations (n, entries) that the readings give; now: the true ones by entry."""
        newest = dict(zip(CHANNELS, self._read[-1].T, strict=True))
        values = now | {name: newest[name] for name in ("p1", "p3")}
        values |= {"I": newest["current"], "p2_error": newest["p2"] - now["target"]}
        for name, lags in (("p2", P2_LAGS), ("p3", P3_LAGS)):
            k = list(CHANNELS).index(name)
            for lag in lags:
                before = self._read[-1 - lag] if len(self._read) > lag else self._read[0]
                values[f"{name}_change_{lag}"] = newest[name] - before[:, k]
        return encode(values)
