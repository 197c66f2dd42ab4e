"""Physical effects that the nominal model leaves out; each one small function, called in one place.

The kernels of integrate.py come in two forms compiled from the same source: `extended=False`, where
every effect is compiled away and costs nothing, and `extended=True`, where each acts with its size and
a size of zero is off. An effect is a field of `Effects` and a function of the state here, and the line
of equations.py that calls it behind `if extended`.
"""

import math
from typing import NamedTuple

from epv_env.plant.compiled import inlined
from epv_env.plant.flow import KAPPA
from epv_env.plant.values import Value

CATALOGUE: dict[str, tuple[str, ...]] = {
    "armature_bounce": ("eMV",),
    "local_gas_speed": ("a1", "a2"),
}
"""Effects by name, with the parameters that size them (epv_env.plant.parameters); all 0 is off.

The bounce acts where a stop is met (integrate.py) and costs nothing there, so it is not in `Effects`."""


class Effects(NamedTuple):
    """Sizes of the effects; 0 is off."""

    a1: Value
    """Cone model of the PV jet (`local_gas_speed`, eq. 15): constant angle [rad]."""
    a2: Value
    """Cone model: angle per gas speed [rad s/m]."""
    RT: Value
    """R T of the supply air, which turns a pressure ratio into a gas speed [J/kg]."""


@inlined
def effective_seat_diameter(xPV, p1, p2, d2, effects):
    """Diameter on which p2 acts when the jet leaves the seat as a cone [m] (eqs 9, 15).

    de = d2 - 2 xPV zeta, zeta = a1 + a2 w, with w the isentropic gas speed from p1 to p2 [m/s].
    """
    ratio = min(p2 / p1, 1.0)
    heat_drop = 2.0 * KAPPA / (KAPPA - 1.0) * effects.RT * (1.0 - ratio ** ((KAPPA - 1.0) / KAPPA))
    zeta = effects.a1 + effects.a2 * math.sqrt(heat_drop)
    return d2 - 2.0 * xPV * zeta
