"""What becomes of readings that no sensor can give: the last good ones stand in for them.

A reading is lost if it is not finite or lies beyond the ends of its sensor. For HELD periods the last
good reading takes its place. After that the controller behind the check takes over
(controllers/p3_check.py). In C the same stands in training/deploy/templates/epv_policy.c.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from epv_env.observation import (
    CENTRE,
    HISTORY,
    INDEX,
    LAYOUT,
    LIMIT,
    P2_LAGS,
    P3_LAGS,
    SCALE,
    decode,
    scaled,
)
from epv_env.plant.channels import CURRENT, P1, P2, P3, Sensor

HELD = 3
"""Control periods for which a reading is held: fewer than the four after which p3 stands still."""

CHANNELS = {"p1": P1, "p2": P2, "p3": P3, "current": CURRENT, "target": P2}
"""Whose ends bound each reading: a target beyond the sensor of p2 cannot be followed."""
READINGS = (*CHANNELS, "coil")
"""Readings of a control unit at the end of a period, in the order of the C structure."""
_P2, _P3, _TARGET = (READINGS.index(name) for name in ("p2", "p3", "target"))
_ENTRIES = [INDEX[name] for name in ("p1", "p2_error", "p3", "I", "target")]
_SCALE, _CENTRE = SCALE[_ENTRIES], CENTRE[_ENTRIES]


def limits(sensors: Mapping[str, Sensor]) -> NDArray:
    """Least and greatest good reading of CHANNELS (2, 5) [bar, A]: the sensors' ends, and one step."""
    ends = [
        (*each.constants()[3:], each.resolution) for each in (sensors[c.name] for c in CHANNELS.values())
    ]
    return np.array([[low - step, high + step] for low, high, step in ends], dtype=np.float32).T


def readings_of(observations: NDArray) -> dict[str, NDArray]:
    """The readings behind observations (..., entries), float32, in bar, A and 0 or 1, by READINGS."""
    columns = np.moveaxis(_read(observations), -1, 0)
    coil = np.rint(decode(observations.astype(np.float64), "action")).astype(np.float32)
    return dict(zip(READINGS, (*columns, coil), strict=True))


def _read(observations: NDArray) -> NDArray:
    """CHANNELS behind observations (..., entries), float32 (..., 5) [bar, A]."""
    read = observations[..., _ENTRIES].astype(np.float64) * _SCALE + _CENTRE
    read[..., _P2] += read[..., _TARGET]  # an observation shows p2 by its distance from the target
    return read.astype(np.float32)


START = _read(np.zeros(len(LAYOUT)))
"""What is held before the first good readings, (5,) [bar, A]: the middle of the observation."""


class HeldReadings:
    """Follows n valves and puts the last good readings in the place of lost ones."""

    def __init__(self, sensors: Mapping[str, Sensor]):
        """sensors: by channel (epv_env.plant.channels.SENSORS, or a plant's own)."""
        self._least, self._greatest = limits(sensors)
        self.reset(0)

    def reset(self, n: int) -> None:
        """Nothing has been read; n episodes begin."""
        self._last = np.tile(START, (n, 1))
        self._rings = np.zeros((n, HISTORY, 2), dtype=np.float32)  # p2 and p3, the newest first
        self._whole = np.full(n, HISTORY)  # periods without a loss
        self.periods = np.zeros(n, dtype=int)
        """Latest periods in a row in each of which a reading was lost (n,)."""
        self.begun = np.zeros(n, dtype=bool)
        """Whether there is something to hold: all readings were good once, or HELD is over (n,)."""
        self.blind = np.zeros(n, dtype=bool)
        """Whether p2 or the target is lost now (n,)."""

    @np.errstate(over="ignore", invalid="ignore")
    def hold(self, observations: NDArray) -> NDArray:
        """Observations (n, entries) as held readings give them; the same ones if none was lost."""
        now = _read(observations)
        lost = ~((now >= self._least) & (now <= self._greatest))
        lost[:, _P2] |= lost[:, _TARGET]
        self._last = np.where(lost, self._last, now)
        self.blind, any_lost = lost[:, _P2], lost.any(axis=1)
        self.periods = np.where(any_lost, self.periods + 1, 0)
        self._whole = np.where(any_lost, 0, self._whole + 1)
        newest = self._last[:, None, [_P2, _P3]]
        shifted = np.concatenate([newest, self._rings[:, :-1]], axis=1)
        self._rings = np.where(self.begun[:, None, None], shifted, newest)
        self.begun |= ~any_lost | (self.periods > HELD)
        touched = self._whole < HISTORY  # a change over past readings reaches back to a loss
        return (
            np.where(touched[:, None], self._rebuilt(observations), observations)
            if touched.any()
            else observations
        )

    def _rebuilt(self, observations: NDArray) -> NDArray:
        """The entries of readings and their changes, made of what is held."""
        p1, p2, p3, current, target = self._last.T
        values = {"p2_error": p2 - target, "target": target, "p1": p1, "p3": p3, "I": current}
        for k, (name, lags) in enumerate((("p2", P2_LAGS), ("p3", P3_LAGS))):
            ring = self._rings[..., k]
            values |= {f"{name}_change_{lag}": ring[:, 0] - ring[:, lag] for lag in lags}
        seen = observations.copy()
        for name, value in values.items():
            i = INDEX[name]
            seen[:, i] = scaled(value, CENTRE[i], SCALE[i], LIMIT[i])
        return seen
