"""Physical effects that the nominal model leaves out; each one small function, called in one place.

The kernels of integrate.py come in two forms compiled from the same source: `extended=False`, where
every effect is compiled away and costs nothing, and `extended=True`, where each acts with its size and
a size of zero is off. An effect is a field of `Effects` and a function of the state here, and the line
of equations.py that calls it behind `if extended`. Forms, ranges and sources: docs/effects.md.
"""

import math
from typing import NamedTuple

from epv_env.plant.compiled import inlined
from epv_env.plant.flow import KAPPA
from epv_env.plant.values import Value

CATALOGUE: dict[str, tuple[str, ...]] = {
    "flyback_voltage": ("U_clamp",),
    "driver_voltage_drop": ("U_drop",),
    "magnetic_saturation": ("sMV",),
    "magnetic_remanence": ("I_rem",),
    "armature_friction": ("F_MV",),
    "armature_bounce": ("eMV",),
    "armature_pressure_force": ("sFMV",),
    "inlet_seat_leak": ("A_in",),
    "exhaust_seat_leak": ("A_exh",),
    "moving_control_volume": ("sV3",),
    "pressure_dependent_discharge": ("kalpha",),
    "critical_pressure_ratio": ("dbcrit",),
    "piston_friction": ("F_PV",),
    "flow_force": ("cflow",),
    "local_gas_speed": ("a1", "a2"),
    "seat_leak": ("A_PV",),
    "circuit_leak": ("A_circuit",),
}
"""Effects by name, with the parameters that size them (epv_env.plant.parameters); all 0 is off.

The bounce acts where a stop is met (integrate.py) and costs nothing there, so it is not in `Effects`."""

OFF_VOLTAGE = 1.0
"""Below this voltage the power stage counts as off [V]."""

CLAMP_WIDTH = 0.01
"""Current over which a clamp's voltage rises to its value [A]: no integrator follows a jump at zero."""

NO_CURRENT = 1e-6
"""Below this the decay against a clamp is over, and the clamp conducts no more [A]."""

SLIDING_SPEED_MV = 0.02
"""Speed over which the armature's friction rises to its value [m/s]; it flies at 0.3 m/s."""

SLIDING_SPEED_PV = 0.02
"""The same for the piston [m/s], which moves at 0.1 m/s and more."""


class Effects(NamedTuple):
    """Sizes of the effects as the equations use them; 0 is off."""

    a1: Value
    """Cone model of the PV jet (`local_gas_speed`, eq. 15): constant angle [rad]."""
    a2: Value
    """Cone model: angle per gas speed [rad s/m]."""
    RT: Value
    """R T of the supply air, which turns a pressure ratio into a gas speed [J/kg]."""
    U_drop: Value
    """Voltage that the power stage keeps from the coil [V]."""
    U_clamp: Value
    """Voltage against which the current decays [V]."""
    saturation: Value
    """Turns over the saturation flux: with I/Rm, how far the iron saturates [1/(V s)]."""
    I_rem: Value
    """Current that would make the residual flux [A]."""
    friction_MV: Value
    """Coulomb friction of the armature [N]."""
    inlet_area: Value
    """Area on which p1 - p3 pulls the armature in [m^2]."""
    exhaust_area: Value
    """Area on which p3 - p_env pushes it back [m^2]."""
    leak_inlet: Value
    """Effective area of the shut inlet [m^2]."""
    leak_exhaust: Value
    """Effective area of the shut exhaust [m^2]."""
    swept: Value
    """Swept area over the control chamber's volume [1/m]."""
    discharge_slope: Value
    """Relative rise of alphaPV with 1 - p2/p1 [-]."""
    drop_deficit: Value
    """1 less the share of the pressure drop that counts towards choking [-]."""
    flow_force: Value
    """Force of the PV jet per opened area and pressure drop [-]."""
    friction_PV: Value
    """Coulomb friction of the piston [N]."""
    leak_PV: Value
    """Effective area of the shut PV seat [m^2]."""
    leak_circuit: Value
    """Effective area of the circuit's leak [m^2]."""
    steady_step: Value
    """Longest step at which the integrator follows friction and the saturated coil [s]."""
    clamp_step: Value
    """Longest step at which it follows the current's decay against a clamp [s]."""


@inlined
def effective_seat_diameter(xPV, p1, p2, d2, effects):
    """Diameter on which p2 acts when the jet leaves the seat as a cone [m] (eqs 9, 15).

    de = d2 - 2 xPV zeta, zeta = a1 + a2 w, with w the isentropic gas speed from p1 to p2 [m/s].
    """
    ratio = min(p2 / p1, 1.0)
    heat_drop = 2.0 * KAPPA / (KAPPA - 1.0) * effects.RT * (1.0 - ratio ** ((KAPPA - 1.0) / KAPPA))
    zeta = effects.a1 + effects.a2 * math.sqrt(heat_drop)
    return d2 - 2.0 * xPV * zeta


@inlined
def coil_voltage(U, I, effects):  # noqa: E741 - the report's symbol
    """What the coil sees of the voltage U [V]: less the driver's drop when on, against a clamp when off.

    The clamp conducts as long as current flows, whichever its direction.
    """
    on = U - min(effects.U_drop, max(U, 0.0))
    clamp = effects.U_clamp * I / math.sqrt(I * I + CLAMP_WIDTH * CLAMP_WIDTH)
    off = U - clamp if abs(I) > NO_CURRENT else U
    return on if U > OFF_VOLTAGE else off


@inlined
def saturation_level(current, inverse_Rm, effects):
    """u of the Froelich-Kennelly curve: flux = N I / (Rm (1 + u)) [-]; 0 for iron that is linear."""
    return effects.saturation * abs(current) * inverse_Rm


@inlined
def saturated_force(u):
    """Magnetic force relative to N^2 I^2/(Rm^2 mu0 A): 1/2 for linear iron [-].

    From the coenergy of the Froelich-Kennelly curve: (ln(1 + u) - u/(1 + u))/u^2, with the logarithm
    as the series 2 artanh(w), w = u/(2 + u): without cancellation at u = 0, within 1e-5 up to u = 3.
    """
    w = u / (2.0 + u)
    s = w * w
    series = s * (1 / 5 + s * (1 / 7 + s * (1 / 9 + s * (1 / 11 + s * (1 / 13 + s * (1 / 15))))))
    return 0.5 * (1.0 - w) * (1.0 - w) * (1.0 / (1.0 + w) + w * (1 / 3 + series))


@inlined
def friction(force, x, v, x_max, size, sliding_speed):
    """Net force on a mover with Coulomb friction [N]; force: without friction.

    At rest on a stop friction resists the release; else it rises to its size over the sliding speed.
    """
    side = (1.0 if x <= 0.0 else 0.0) - (1.0 if x >= x_max else 0.0)
    sliding = v / math.sqrt(v * v + sliding_speed * sliding_speed)
    return force - size * (side if v == 0.0 else sliding)


@inlined
def opened(area, bore, leak):
    """Effective area of a MV seat that does not close fully [m^2]: from the leak, shut, to the bore."""
    return area + leak * (1.0 - area / bore)


@inlined
def discharge(p1, p2, effects):
    """alphaPV relative to its value without a pressure drop [-] (Perry 1949: it rises with the drop)."""
    return 1.0 + effects.discharge_slope * (1.0 - min(p2 / p1, 1.0))


@inlined
def longest_step(U, I, effects):  # noqa: E741 - the report's symbol
    """Longest step that the effects allow at present [s]."""
    clamped = (U <= OFF_VOLTAGE) & (abs(I) > NO_CURRENT)
    return min(effects.steady_step, effects.clamp_step if clamped else effects.steady_step)
