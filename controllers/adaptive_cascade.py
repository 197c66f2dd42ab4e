"""Adaptive cascade: p2 asks for a control pressure by the piston's force balance, p3 is switched to it.

The on/off counterpart of the PWM cascade (controllers/pwm.py): a pulse lasts whole control periods, and
every period decides anew. The opening pressure, gain and venting rate are those that the valve's own
answers tell (controllers/valve_learner.py).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.opening_pressure import opening_pressure
from controllers.pulse_simulation import nominal_table
from controllers.pulse_table import PulseTable
from controllers.pwm_linearisation import switching_lag
from controllers.registration import CHEAP, Range, Registration
from controllers.valve_learner import LearntValve, ValveLearner
from controllers.venting_time import relative_flux
from epv_env.common.units import BAR
from epv_env.observation import decode
from epv_env.plant.plantfile import Plant
from epv_env.plant.primitives import QUARTER_PI, mass_flux


@dataclass(kw_only=True)
class AdaptiveCascade:
    """Holds p3 ready above the opening pressure, and below it by what the circuit needs.

    A PI controller of p2 and the consumption found while the valve was shut ask for a flow. The force
    balance of the piston turns the flow into a depth of p3 below the opening pressure. The servo then
    takes the action after which p3, when the next one can act, is closest to that. Its prediction
    counts the armature's lags, which differ for pulling in and dropping out: compensation of dead time.
    """

    table: PulseTable
    """Of the nominal plant."""
    pull_in_lag: float
    """From switching on to the control chamber's filling [s]."""
    outer_time: float
    """Time in which the flow asked for makes up a deviation of p2 [s]."""
    integral_time: float
    """Tn of the PI controller of p2 [s]."""
    setpoint: float
    """Setpoint of p2 - target [bar]."""
    idle: float
    """How far p3 is held above the opening pressure when no air is needed [bar]."""
    depth: float
    """Largest distance of p3 below the opening pressure [bar]."""
    rest_above: float
    """p2 - target above which the coil stays on [bar]."""
    reluctance: float
    """How much closer p3 must come by a switching than without it [bar]."""
    filter_time: float
    """Time in which the weight of a reading of p2 fades by 1/e [s]."""
    control_period: float = 5e-3
    """[s]"""
    name: str = "cascade, adaptive"
    environment: str = "EPValve-v0"
    _learner: ValveLearner = field(init=False, repr=False)
    _integral: NDArray = field(default_factory=lambda: np.zeros(0), repr=False)

    def __post_init__(self) -> None:
        self._learner = ValveLearner(
            self.table, filter_time=self.filter_time, control_period=self.control_period
        )

    def reset(self, n: int) -> None:
        """Forget consumption and valves; n episodes begin."""
        self._learner.reset(n)
        self._integral = np.zeros(n)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        valve = self._learner.observe(observations)
        rests = (valve.error > self.rest_above) | ~valve.fed
        wanted = self._wanted(valve, rests)
        off, on = self.foreseen(valve, decode(observations, "since_switching"))
        favour = np.where(valve.on, 0.5, -0.5) * self.reluctance
        switched_on = np.abs(on - wanted) < np.abs(off - wanted) + favour
        action = np.where(rests | switched_on, 1, 0)
        self._learner.decided(action)
        return action

    def _wanted(self, valve: LearntValve, rests: NDArray) -> NDArray:
        """Control pressure (n,) [bar] for the flow asked for; rests: whether none is, bool (n,)."""
        missing = self.setpoint - valve.error
        asked = missing / self.outer_time + self._integral - valve.fall
        below = asked / (self.flow_per_depth(valve.p1, valve.p2) * valve.gain)
        inside = ~rests & (below > 0) & (below < self.depth)  # against wind-up
        growth = missing / (self.outer_time * self.integral_time) * self.control_period
        self._integral = np.where(inside, self._integral + growth, np.where(rests, 0.0, self._integral))
        opening = opening_pressure(valve.table.parameters, valve.p1 * BAR, valve.p2 * BAR) / BAR
        return opening + np.where(below > 0, -np.minimum(below, self.depth), self.idle)

    def flow_per_depth(self, p1: NDArray, p2: NDArray) -> NDArray:
        """Rate of p2 for each bar of p3 below the opening pressure (n,) [1/s] (eq. 22 at rest, eq. 6).

        p1, p2: supply and circuit pressure (n,) [bar absolute]. The piston's stroke is what its spring
        yields to the missing control pressure.
        """
        p = self.table.parameters
        stroke = QUARTER_PI * p["d1"] ** 2 / p["cPV"]  # m/Pa
        area = p["alphaPV"] * np.pi * p["d2"] * stroke
        RT = p["R_gas"] * p["T_env"]
        choked = mass_flux(1.0, 0.0, 1 / np.sqrt(RT))  # of 1 Pa
        return RT / p["V2"] * area * choked * p1 * BAR * relative_flux(p1 / p2)

    def foreseen(self, valve: LearntValve, since: NDArray) -> tuple[NDArray, NDArray]:
        """p3 (n,) [bar] when the next decision can act, if the coil is now off, and if it is now on.

        since: time since the last switching (n,) [s].
        """
        vents, fills = self._rates(valve)
        dropping, pulling = self.table.release_lag, self.pull_in_lag
        on, period = valve.on, self.control_period
        late_on = np.where(on, np.maximum(pulling - since, 0.0), 0.0)  # the armature has yet to move
        late_off = np.where(on, 0.0, np.maximum(dropping - since, 0.0))
        filling = np.where(on, np.maximum(dropping - late_on, 0.0), late_off)
        off_end = valve.p3 + fills * filling - vents * (period + pulling - filling)
        venting = np.where(on, late_on, np.maximum(pulling - late_off, 0.0))
        on_end = valve.p3 + fills * (period + dropping - venting) - vents * venting
        return np.maximum(off_end, 1.0), np.minimum(on_end, valve.p1)

    def _rates(self, valve: LearntValve) -> tuple[NDArray, NDArray]:
        """Rates at which p3 falls while venting, and rises while filling (n,) [bar/s] (eq. 7)."""
        p, rate = self.table.parameters, self.table.vent_rate * valve.pace
        bores = (p["dMVin"] / p["dMVexh"]) ** 2
        ambient = p["p_env"] / BAR
        vents = rate * valve.p3 * relative_flux(valve.p3 / ambient)
        fills = rate * bores * valve.p1 * relative_flux(valve.p1 / valve.p3)
        return vents, fills


def build(values: Mapping[str, Any], plant: Plant) -> AdaptiveCascade:
    """The controller for a plant; values: quantities of the search space by name."""
    table = nominal_table(plant)
    later = switching_lag(plant.parameters, p1=11.5 * BAR, p2=8.0 * BAR, supply_voltage=plant.voltage)
    return AdaptiveCascade(table=table, pull_in_lag=float(table.release_lag) + later, **values)


REGISTRATION = Registration(
    kind="cascade, adaptive",
    controller=AdaptiveCascade,
    build=build,
    search_space={
        "outer_time": Range(low=0.01, high=0.2, log=True, least=0.003, most=2.0),
        "integral_time": Range(low=0.1, high=5.0, log=True, least=0.02, most=100.0),
        "setpoint": Range(low=-0.2, high=0.3, least=-0.5, most=0.5),
        "idle": Range(low=0.0, high=1.5, most=6.0),
        "depth": Range(low=0.1, high=2.0, log=True, least=0.01, most=8.0),
        "rest_above": Range(low=-0.1, high=0.5, least=-0.5, most=2.0),
        "reluctance": Range(low=0.0, high=0.5, most=3.0),
        "filter_time": Range(low=0.004, high=0.04, log=True, least=0.001, most=0.4),
    },
    cost=CHEAP,
)
