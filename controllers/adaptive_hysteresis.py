"""Adaptive extrapolating hysteresis: two thresholds of a pressure that the learnt valve predicts.

The extrapolating hysteresis (controllers/hysteresis.py) predicts with two fixed times. Here the learnt
valve predicts (controllers/valve_learner.py): while shut, p2 at the instant at which the piston would
lift; while open, p2 after the valve has shut, if the coil were switched on now.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.pulse_simulation import nominal_table
from controllers.pulse_table import PulseTable
from controllers.registration import CHEAP, Range, Registration
from controllers.valve_learner import ValveLearner


@dataclass(kw_only=True)
class AdaptiveHysteresis:
    """Opens below one threshold of the predicted p2 - target, shuts above another."""

    table: PulseTable
    """Of the nominal plant."""
    open_below: float
    """Predicted p2 - target below which the coil is switched off [bar]."""
    shut_above: float
    """Predicted p2 - target above which the coil is switched on [bar]."""
    filter_time: float
    """Time in which the weight of a reading of p2 fades by 1/e [s]."""
    look_ahead: float
    """Share of the time to open over which p2 is extrapolated [1]."""
    control_period: float = 5e-3
    """[s]"""
    name: str = "hysteresis, adaptive"
    environment: str = "EPValve-v0"
    _learner: ValveLearner = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.open_below > self.shut_above:
            raise ValueError(
                f"open_below = {self.open_below:g} bar exceeds shut_above = {self.shut_above:g} bar: "
                "a hysteresis needs open_below <= shut_above"
            )
        self._learner = ValveLearner(
            self.table, filter_time=self.filter_time, control_period=self.control_period
        )

    def reset(self, n: int) -> None:
        """Forget consumption and valves; n episodes begin."""
        self._learner.reset(n)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        valve = self._learner.observe(observations)
        opens = valve.fed & valve.shut & (valve.forecast(self.look_ahead) < self.open_below)
        rises = valve.table.gained(valve.p1, valve.p2, valve.p3, np.zeros_like(valve.p1))
        shuts = ~valve.fed | (valve.error + valve.gain * rises > self.shut_above)
        action = np.where(valve.on, np.where(opens, 0, 1), np.where(shuts, 1, 0))
        self._learner.decided(action)
        return action


REGISTRATION = Registration(
    kind="hysteresis, adaptive",
    controller=AdaptiveHysteresis,
    build=lambda values, plant: AdaptiveHysteresis(table=nominal_table(plant), **values),
    search_space={
        "open_below": Range(low=-0.3, high=0.1, least=-0.5, most=0.5),
        "shut_above": Range(low=-0.3, high=0.3, least=-0.5, most=0.5),
        "filter_time": Range(low=0.004, high=0.04, log=True, least=0.001, most=0.4),
        "look_ahead": Range(low=0.3, high=1.5, least=0.0, most=4.0),
    },
    cost=CHEAP,
)
"""The extrapolating hysteresis that finds out which valve it has."""
