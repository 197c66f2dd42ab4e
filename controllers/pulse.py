"""Pulse control: the inverse of the calibrated model gives the time for which the coil is off.

The idea is the report's own deactivation pulse (section 3), planned instead of fixed. The filter is the
fading-memory g-h filter of Brookner, Tracking and Kalman Filtering Made Easy (1998), chapter 1.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.pulse_simulation import nominal_table
from controllers.pulse_table import PulseTable
from controllers.registration import CHEAP, Range, Registration
from controllers.reserve import fed, reserve_of
from epv_env.observation import decode


@dataclass(kw_only=True)
class Pulse:
    """Raises p2 by pulses of a planned pressure, each from a trigger to an aim.

    A pulse begins when p2 - target, extrapolated with the slope that consumption gives p2 to the instant
    at which the vented control chamber would let the valve open, is below the trigger. While the coil is
    off, the controller plans its remaining time anew every period from the measured pressures. So errors
    of the model are corrected until the last period. The coil switches at whole periods only, and one
    period may be worth 200 mbar; `rounding` says which of two neighbouring instants is taken.

    The controller reads the coil's last action from the observation, so it also works when another
    controller overrules it. A pulse may follow another as soon as the valve has shut. If p3 is still
    low, the valve opens sooner and the extrapolation is shorter, so the pulse begins later.
    """

    table: PulseTable
    """Of the plant."""
    trigger: float
    """Predicted p2 - target below which a pulse begins [bar]."""
    aim: float
    """p2 - target at which a pulse shall end [bar]."""
    filter_time: float
    """Time in which the weight of a reading of p2 fades by 1/e [s]."""
    look_ahead: float
    """Share of the time to open over which p2 is extrapolated [1]."""
    rounding: float
    """Remaining time below which a pulse ends now [control periods]: 0.5 rounds, 1 never overshoots."""
    tolerated: float = np.inf
    """Expected breakdown that needs no reserve [bar] (controllers/reserve.py); infinite: none does."""
    control_period: float = 5e-3
    """[s]"""
    name: str = "pulse"
    environment: str = "EPValve-v0"
    _error: NDArray = field(default_factory=lambda: np.zeros(0), repr=False)
    _slope: NDArray = field(default_factory=lambda: np.zeros(0), repr=False)
    _was_shut: NDArray = field(default_factory=lambda: np.zeros(0, dtype=bool), repr=False)

    def __post_init__(self) -> None:
        if self.trigger >= self.aim:
            raise ValueError(
                f"trigger = {self.trigger:g} bar is not below aim = {self.aim:g} bar: a pulse only adds "
                "pressure, give trigger < aim"
            )

    def reset(self, n: int) -> None:
        """Forget the consumption; n episodes begin."""
        self._error = np.zeros(n)
        self._slope = np.zeros(n)
        self._was_shut = np.zeros(n, dtype=bool)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve."""
        error, target, p1, p3, coil = (
            decode(observations, name).astype(float)
            for name in ("p2_error", "target", "p1", "p3", "action")
        )
        p2 = error + target
        opens_in = self.table.time_to_open(p1, p2, p3)
        self._estimate(error, opens_in > 0)
        falls = np.minimum(self._slope, 0.0)  # only consumption moves p2 behind a shut valve
        above = self._error - self._reserve(p1, target)
        return self.decide((p1, p2, p3), opens_in, above, falls, coil > 0.5).astype(int)

    def decide(
        self,
        pressures: tuple[NDArray, NDArray, NDArray],
        opens_in: NDArray,
        error: NDArray,
        falls: NDArray,
        coil: NDArray,
    ) -> NDArray:
        """Whether to energise each coil, bool (n,); all arguments are arrays (n,).

        Args:
            pressures: p1, p2 and p3 [bar absolute].
            opens_in: the table's time to open at these pressures [s].
            error: p2 - target, less the reserve [bar].
            falls: slope that consumption gives p2, zero or negative [bar/s].
            coil: whether it is energised now.
        """
        ahead = self.look_ahead * (opens_in + self.table.release_lag)
        feeds = fed(*pressures[:2])
        begins = feeds & (opens_in > 0) & (error + falls * ahead < self.trigger)
        remaining = self.table.duration(*pressures, self.aim - error, falls)
        ends = ~feeds | (remaining < self.rounding * self.control_period)
        return np.where(coil, ~begins, ends)

    def _reserve(self, p1: NDArray, target: NDArray) -> NDArray | float:
        """How much higher p2 is held (n,) [bar]; the control chamber at rest holds p1."""
        if np.isinf(self.tolerated):
            return 0.0
        return reserve_of(self.table, self.table.time_to_open(p1, target, p1), self.tolerated)

    def _estimate(self, error: NDArray, shut: NDArray) -> None:
        """Follow p2 - target and its slope while the valve is shut; while it is open keep the slope.

        shut: (n,) whether it is. The filter's gains are those of critical damping.
        """
        fading = np.exp(-self.control_period / self.filter_time)
        expected = self._error + self._slope * self.control_period
        surprise = error - expected
        follows = shut & self._was_shut
        self._error = np.where(follows, expected + (1 - fading**2) * surprise, error)
        growth = (1 - fading) ** 2 * surprise / self.control_period
        self._slope = self._slope + np.where(follows, growth, 0.0)
        self._was_shut = shut


REGISTRATION = Registration(
    kind="pulse",
    controller=Pulse,
    build=lambda values, plant: Pulse(table=nominal_table(plant), **values),
    search_space={
        "trigger": Range(low=-0.3, high=0.1, least=-0.5, most=0.5),
        "aim": Range(low=-0.1, high=0.3, least=-0.5, most=0.5),
        "filter_time": Range(low=0.004, high=0.04, log=True, least=0.001, most=0.4),
        "look_ahead": Range(low=0.3, high=1.5, least=0.0, most=4.0),
        "rounding": Range(low=0.2, high=1.2, least=0.0, most=2.0),
    },
    cost=CHEAP,
)
