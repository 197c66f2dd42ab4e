"""A supervisor around a learned policy: it corrects the policy by what it learns about the valve.

A learner of the valve (controllers/valve_learner.py) estimates how long the valve takes to open, and
how far a pulse under way still raises p2. The supervisor moves the policy's setpoint by the first (a
reference governor: Garone, Di Cairano and Kolmanovsky, Automatica 75 (2017)) and ends pulses by the
second.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller, Privileged, with_period
from controllers.pulse_table import PulseTable
from controllers.reserve import expected_breakdown
from controllers.valve_learner import LearntValve, ValveLearner
from epv_env.observation import INDEX, LAYOUT

ERROR = INDEX["p2_error"]


@dataclass(kw_only=True)
class Supervisor:
    """Lets `main` act on a setpoint that suits the valve, and ends what would rise too far.

    The settings were chosen by hand on development episodes of two policies: the packaged recurrent one
    and one trained end to end.
    """

    main: Controller
    """For the on/off environment."""
    table: PulseTable
    """Of the nominal plant."""
    share: float = 0.3
    """Rise of the setpoint for each bar of expected breakdown beyond `typical` [1]."""
    typical: float = 0.36
    """Expected breakdown that leaves the setpoint as it is [bar]."""
    most: float = 0.12
    """Largest shift of the setpoint, either way [bar]."""
    ceiling: float = 0.15
    """Expected p2 - target, with its uncertainty, above which a pulse ends [bar]."""
    caution: float = 0.42
    """Rise allowed for by a bar of the opening pressure's standard deviation [1]."""
    filter_time: float = 0.025
    """Time in which the weight of a reading of p2 fades by 1/e [s]."""
    control_period: float = 5e-3
    """[s]"""
    name: str = field(init=False)
    environment: str = field(init=False)
    _learner: ValveLearner = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if isinstance(self.main, Privileged):
            raise ValueError(
                f"{self.main.name!r} reads no sensor: give a controller that acts on readings"
            )
        if self.main.environment != "EPValve-v0":
            raise ValueError(
                f"{self.main.name!r} is for {self.main.environment}: a supervisor ends pulses of the "
                "coil, give a controller for EPValve-v0"
            )
        self.main = with_period(self.main, self.control_period)
        self.name, self.environment = f"{self.main.name}, supervised", self.main.environment
        self._learner = ValveLearner(
            self.table, filter_time=self.filter_time, control_period=self.control_period
        )

    def reset(self, n: int) -> None:
        """Forget the valves; n episodes begin."""
        self.main.reset(n)
        self._learner.reset(n)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        valve = self._learner.observe(observations)
        shown = observations.copy()
        shown[:, ERROR] -= (self.shift(valve) / LAYOUT[ERROR].scale).astype(shown.dtype)
        action = np.where(self._must_shut(valve), 1, self.main.act(shown))
        self._learner.decided(valve, action)
        return action

    def shift(self, valve: LearntValve) -> NDArray:
        """How much higher p2 is held (n,) [bar]; none while the supply cannot raise it."""
        expected = expected_breakdown(self.table, valve.opens_from_rest)
        wanted = np.clip(self.share * (expected - self.typical), -self.most, self.most)
        return np.where(valve.fed, wanted, 0.0)

    def _must_shut(self, valve: LearntValve) -> NDArray:
        """Whether the coil has to be on, bool (n,): no supply, or p2 would rise beyond the ceiling."""
        rise = valve.gain * valve.under_way
        uncertain = np.hypot(self.caution * valve.offset_deviation, valve.gain_deviation * rise)
        too_far = ~valve.shut & (valve.error + rise + uncertain > self.ceiling)
        return ~valve.fed | too_far
