"""Sensors that fail from an instant on: what a controller then reads."""

from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from epv_env.observation import HISTORY, LAYOUT, P2_LAGS, P3_LAGS, decode, encode
from epv_env.plant.channels import CURRENT, P1, P2, P3

BEGINS_S = 2.0
"""When the sensors of an episode fail [s]."""
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
    """The readings of n episodes whose sensors fail at BEGINS_S."""

    def __init__(self, faults: Sequence[Fault], n: int, period: float, rng: np.random.Generator):
        """
        Args:
            faults: of the sensors of all episodes.
            n: episodes.
            period: control period [s].
            rng: draws wild readings and the directions of a drift.
        """
        self._faults = [(list(CHANNELS).index(channel), kind) for channel, kind in faults]
        self._rng, self._step, self._left = rng, period, round(BEGINS_S / period)
        ends = [each.sensor.constants()[3:] for each in CHANNELS.values()]
        self._low, self._high = np.array(ends).T
        drift = DRIFT * (self._high - self._low)
        self._drift = drift * rng.choice([-1.0, 1.0], (n, len(CHANNELS)))
        self._true: deque[NDArray] = deque(maxlen=DELAY + 1)
        self._read: deque[NDArray] = deque(maxlen=HISTORY)

    def shown(self, seen: NDArray) -> NDArray:
        """Observations (n, entries) of the next period as the failing sensors give them."""
        now = {entry.name: decode(seen, entry.name) for entry in LAYOUT}
        pressures = now["p1"], now["p2_error"] + now["target"], now["p3"]
        true = np.stack([*pressures, now["I"]], axis=1)
        self._true.append(true)
        self._read.append(true.copy())
        self._left -= 1
        if self._left >= 0:
            self._stuck = true
            return seen
        moved = true - self._drift * self._left * self._step
        broken = {
            "stuck": self._stuck, "zero": 0 * true, "saturated": self._high + 0 * true,
            "wild": self._rng.uniform(self._low, self._high, true.shape), "delayed": self._true[0],
            "drifting": np.clip(moved, self._low, self._high), "swapped": true[:, PARTNERS],
        }  # fmt: skip
        for k, kind in self._faults:
            self._read[-1][:, k] = broken[kind][:, k]
        return self._encoded(now)

    def _encoded(self, now: dict[str, NDArray]) -> NDArray:
        """The observations (n, entries) that the readings give; now: the true ones by entry."""
        newest = dict(zip(CHANNELS, self._read[-1].T, strict=True))
        values = now | {name: newest[name] for name in ("p1", "p3")}
        values |= {"I": newest["current"], "p2_error": newest["p2"] - now["target"]}
        for name, lags in (("p2", P2_LAGS), ("p3", P3_LAGS)):
            k = list(CHANNELS).index(name)
            for lag in lags:
                values[f"{name}_change_{lag}"] = newest[name] - self._read[-1 - lag][:, k]
        return encode(values)
