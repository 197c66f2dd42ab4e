"""A check of the sensors, of p3 above all, worn around a controller that believes its readings.

A reading is lost if it is not finite or lies beyond the ends of its sensor. For HELD periods the last
good reading takes its place. The coil decides where p3 goes: on, the control chamber fills up to p1;
off, it empties to the ambient pressure. A reading far from that end that stands still contradicts the
coil. From then on, or where readings are lost for more than HELD periods, a controller that does not
read p3 takes over; without p2 and a target it is blind, and the coil stays on. In C the same stands in
training/deploy/templates/epv_policy.c.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller, Privileged
from epv_env import observation as o
from epv_env.plant.channels import CURRENT, P1, P2, P3, SENSORS, Sensor

HELD = 3
"""Control periods for which a reading is held: fewer than the four after which p3 stands still."""
CHANGE = "p3_change_4"
"""The entry of the observation whose magnitude says whether p3 moves."""
WAIT = 25e-3
"""Time for which the coil has been as it is before p3 must move [s]: the armature's delay, the latency
of the command, and the four periods over which the change is observed."""
STILL = 0.02
"""Change over four periods below which p3 stands still [bar]: twice the standard deviation that Table
3's noise gives it. A chamber that fills or empties moves many times as much."""
MARGIN = 0.5
"""Distance of p3 from the end that it goes to, within which it may stand still [bar]."""
AMBIENT = 1.0
"""Pressure that the chamber empties to [bar]."""

CHANNELS = {"p1": P1, "p2": P2, "p3": P3, "current": CURRENT, "target": P2}
"""Whose ends bound each reading: a target beyond the sensor of p2 cannot be followed."""
READINGS = (*CHANNELS, "coil")
"""Readings of a control unit at the end of a period, in the order of the C structure."""
_P2, _P3, _TARGET = (READINGS.index(name) for name in ("p2", "p3", "target"))
_ENTRIES = [o.INDEX[name] for name in ("p1", "p2_error", "p3", "I", "target")]


def limits(sensors: Mapping[str, Sensor]) -> NDArray:
    """Least and greatest good reading of CHANNELS (2, 5) [bar, A]: the sensors' ends, and one step."""
    ends = []
    for channel in CHANNELS.values():
        *_, low, high = sensors[channel.name].constants()
        step = sensors[channel.name].resolution
        ends.append((low - step, high + step))
    return np.array(ends, dtype=np.float32).T


def readings_of(observations: NDArray) -> dict[str, NDArray]:
    """The readings behind observations (..., entries), float32, in bar, A and 0 or 1, by READINGS."""
    columns = np.moveaxis(_read(observations), -1, 0)
    coil = np.rint(o.in_units(observations)[..., o.INDEX["action"]]).astype(np.float32)
    return dict(zip(READINGS, (*columns, coil), strict=True))


def _read(observations: NDArray) -> NDArray:
    """CHANNELS behind observations (..., entries), float32 (..., 5) [bar, A]."""
    read = o.in_units(observations)[..., _ENTRIES]
    read[..., _P2] += read[..., _TARGET]  # an observation shows p2 by its distance from the target
    return read.astype(np.float32)


START = _read(np.zeros(len(o.LAYOUT)))
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
        self._rings = np.zeros((n, o.HISTORY, 2), dtype=np.float32)  # p2 and p3, the newest first
        self._whole = np.full(n, o.HISTORY)  # periods without a loss
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
        touched = self._whole < o.HISTORY  # a change over past readings reaches back to a loss
        return (
            np.where(touched[:, None], self._rebuilt(observations), observations)
            if touched.any()
            else observations
        )

    def _rebuilt(self, observations: NDArray) -> NDArray:
        """The entries of readings and their changes, made of what is held."""
        p1, p2, p3, current, target = self._last.T
        values = {"p2_error": p2 - target, "target": target, "p1": p1, "p3": p3, "I": current}
        for k, (name, lags) in enumerate((("p2", o.P2_LAGS), ("p3", o.P3_LAGS))):
            ring = self._rings[..., k]
            values |= {f"{name}_change_{lag}": ring[:, 0] - ring[:, lag] for lag in lags}
        rebuilt = observations.copy()
        rebuilt[:, [o.INDEX[name] for name in values]] = o.encode(values)
        return rebuilt


@dataclass(kw_only=True)
class P3Check:
    """Lets `main` act until a valve's sensors fail, and `fallback` from then to the reset."""

    main: Controller
    """For the on/off environment."""
    fallback: Controller
    """For the same environment; it must not read p3."""
    control_period: float = 5e-3
    """[s]"""
    sensors: Mapping[str, Sensor] = field(default_factory=lambda: SENSORS, repr=False)
    """By channel: their ends tell which readings are lost."""
    name: str = ""
    """Default: that of `main`, with a word about the check."""
    environment: str = field(init=False)
    failed: NDArray = field(default_factory=lambda: np.zeros(0, dtype=bool), init=False, repr=False)
    """Whether p3 was implausible or readings were lost since the reset, bool (n,)."""

    def __post_init__(self) -> None:
        if isinstance(self.main, Privileged):
            raise ValueError(f"{self.main.name!r} reads no sensor: there is no p3 to check")
        if self.main.environment != self.fallback.environment:
            raise ValueError(
                f"{self.fallback.name!r} is for {self.fallback.environment} and {self.main.name!r} for "
                f"{self.main.environment}: the one that takes over must act in the same environment"
            )
        self.name = self.name or f"{self.main.name}, p3 checked"
        self.environment = self.main.environment
        self._readings = HeldReadings(self.sensors)
        self._periods = 0

    def reset(self, n: int) -> None:
        """Believe every sensor; n episodes begin."""
        self.main.reset(n)
        self.fallback.reset(n)
        self._readings.reset(n)
        self.failed = np.zeros(n, dtype=bool)
        self._periods = 0

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        self._periods += 1
        observations, read = self._readings.hold(observations), self._readings
        self.failed = self.failed | self._implausible(observations) | (read.periods > HELD)
        # Both follow every valve: the one that takes over knows what has happened.
        actions = self.main.act(observations), self.fallback.act(observations)
        blind = ~read.begun | (self.failed & read.blind)
        return np.where(blind, 1, np.where(self.failed, actions[1], actions[0]))

    def _implausible(self, observations: NDArray) -> NDArray:
        """Whether p3 stands still where the coil should move it, bool (n,)."""
        p1, p3, coil, lasted, change = (
            o.decode(observations, name) for name in ("p1", "p3", "action", "since_switching", CHANGE)
        )
        on = coil > 0.5
        remains = np.where(on, p1 - p3, p3 - AMBIENT)
        # What happened before the first observation is not known: the coil may have switched just then.
        known = np.minimum(lasted, self._periods * self.control_period)
        waited = known > min(WAIT, o.LONGEST_WAIT) - self.control_period / 2  # whole periods
        return waited & (np.abs(change) < STILL) & (remains > MARGIN)
