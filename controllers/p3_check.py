"""A check of the sensors, of p3 above all, worn around a controller that believes its readings.

The coil decides where p3 goes: on, the control chamber fills up to p1; off, it empties to the ambient
pressure. A reading far from that end that stands still contradicts the coil. From then on a controller
that does not read p3 takes over. So it does where readings are lost (controllers/held_readings.py) for
more than HELD periods; without p2 and a target it is blind, and the coil stays on. Above the band it is
on, too, whoever decides (shield 3 of controllers/knowledge.py).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller, Privileged
from controllers.held_readings import HELD, HeldReadings
from controllers.knowledge import above_band
from epv_env.observation import LONGEST_WAIT, decode
from epv_env.plant.channels import SENSORS, Sensor

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
    _failed: NDArray = field(default_factory=lambda: np.zeros(0, dtype=bool), repr=False)
    _periods: int = field(default=0, repr=False)

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

    @property
    def failed(self) -> NDArray:
        """Whether p3 was implausible or readings were lost since the reset, bool (n,)."""
        return self._failed

    def reset(self, n: int) -> None:
        """Believe every sensor; n episodes begin."""
        self.main.reset(n)
        self.fallback.reset(n)
        self._readings.reset(n)
        self._failed = np.zeros(n, dtype=bool)
        self._periods = 0

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        self._periods += 1
        observations, read = self._readings.hold(observations), self._readings
        self._failed = self._failed | self._implausible(observations) | (read.periods > HELD)
        # Both follow every valve: the one that takes over knows what has happened.
        actions = self.main.act(observations), self.fallback.act(observations)
        blind = ~read.begun | (self._failed & read.blind)
        above = above_band(decode(observations, "p2_error"))
        return np.where(blind | above, 1, np.where(self._failed, actions[1], actions[0]))

    def _implausible(self, observations: NDArray) -> NDArray:
        """Whether p3 stands still where the coil should move it, bool (n,)."""
        p1, p3, coil, lasted, change = (
            decode(observations, name) for name in ("p1", "p3", "action", "since_switching", CHANGE)
        )
        on = coil > 0.5
        remains = np.where(on, p1 - p3, p3 - AMBIENT)
        # What happened before the first observation is not known: the coil may have switched just then.
        known = np.minimum(lasted, self._periods * self.control_period)
        waited = known > min(WAIT, LONGEST_WAIT) - self.control_period / 2  # whole periods
        return waited & (np.abs(change) < STILL) & (remains > MARGIN)
