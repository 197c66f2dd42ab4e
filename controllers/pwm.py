"""PWM control: a cascade of PI (circuit pressure) and P (control pressure) sets the coil's duty."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from controllers.pulse_table import opening_pressure
from controllers.registration import Range, Registration
from epv_env.common.units import BAR
from epv_env.observation import decode
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant

if TYPE_CHECKING:
    from controllers.pwm_design import Design

PERIOD = 20e-3
"""Period of the PWM [s]: the environment's."""


@dataclass(kw_only=True)
class PWM:
    """Holds p3 near the opening pressure of the protection valve while the circuit needs air.

    While p2 is high enough the coil stays on and nothing switches. Below `engage_below` the cascade
    takes over until p2 is above `rest_above`.
    """

    design: "Design"
    """Gains of the cascade."""
    parameters: Parameters = field(repr=False)
    """Of the plant of the design: areas and spring set the opening pressure (eq. 22)."""
    engage_below: float
    """p2 - target below which the cascade starts [bar]."""
    rest_above: float
    """p2 - target above which the coil stays on [bar]."""
    depth: float
    """Largest distance of the wanted p3 below the opening pressure [bar]: limits the PV's stroke."""
    setpoint: float = 0.0
    """Setpoint of p2 - target in the cascade [bar]."""
    control_period: float = PERIOD
    """Period of the PWM [s]."""
    name: str = "PWM"
    environment: str = "EPValvePWM-v0"
    _integral: NDArray = field(default_factory=lambda: np.zeros(0), repr=False)
    _working: NDArray = field(default_factory=lambda: np.zeros(0, dtype=bool), repr=False)

    def reset(self, n: int) -> None:
        """Empty integrators and all coils on; n episodes begin."""
        self._integral = np.zeros(n)
        self._working = np.zeros(n, dtype=bool)

    def act(self, observations: NDArray) -> NDArray:
        """Actions (n, 1) in [-1, 1]: 2 duty - 1."""
        error = decode(observations, "p2_error")
        p1, p3 = decode(observations, "p1"), decode(observations, "p3")
        p2 = error + decode(observations, "target")
        self._working = np.where(self._working, error < self.rest_above, error < self.engage_below)

        deviation = error - self.setpoint
        asked = self.design.outer_gain * (deviation + self._integral)
        opening = opening_pressure(self.parameters, p1 * BAR, p2 * BAR) / BAR
        wanted_p3 = opening + np.maximum(asked, -self.depth)
        duty = self.design.duty + self.design.inner_gain * (wanted_p3 - p3)
        duty = np.where(self._working, duty, 1.0)
        # conditional integration against wind-up
        inside = (duty > 0) & (duty < 1) & (asked > -self.depth)
        grown = self._integral + deviation * self.control_period / self.design.integral_time
        self._integral = np.where(inside, grown, np.where(self._working, self._integral, 0.0))
        return (2 * np.clip(duty, 0.0, 1.0) - 1)[:, None].astype(np.float32)


def build(values: Mapping[str, Any], plant: Plant) -> PWM:
    """The controller with a loop shaped for a plant.

    values: quantities of the search space by name. Raises ValueError if no gain keeps the phase margin.
    """
    from controllers.pwm_design import design  # needs the extra `control`

    loop = {name: values[name] for name in ("inner_time", "phase_margin", "integral_time")}
    rest = {name: value for name, value in values.items() if name not in loop}
    shaped = design(  # in the middle of the reservoirs' range, and of the targets'
        plant.parameters, p1=11.5 * BAR, p2=8.0 * BAR, period=PERIOD, supply_voltage=plant.voltage,
        **loop,
    )  # fmt: skip
    return PWM(design=shaped, parameters=plant.parameters, **rest)


REGISTRATION = Registration(
    kind="PWM",
    controller=PWM,
    build=build,
    search_space={
        "inner_time": Range(low=0.005, high=0.06, log=True),
        "phase_margin": Range(low=20.0, high=60.0),
        "integral_time": Range(low=0.2, high=3.0, log=True),
        "depth": Range(low=0.03, high=0.8, log=True),
        "setpoint": Range(low=-0.3, high=0.2),
        "engage_below": Range(low=-0.4, high=0.3),
        "rest_above": Range(low=-0.3, high=0.4),
    },
    tuned_on="exact",  # within ±10 % no tuning holds the band, and the search finds nothing useful
)
