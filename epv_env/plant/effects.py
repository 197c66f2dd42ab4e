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
    "coil_heating": ("h_coil", "theta_coil"),
    "eddy_current": ("G_eddy",),
    "flyback_voltage": ("U_clamp",),
    "driver_voltage_drop": ("U_drop",),
    "magnetic_saturation": ("sMV",),
    "magnetic_remanence": ("I_rem",),
    "armature_friction": ("F_MV",),
    "armature_bounce": ("eMV",),
    "armature_pressure_force": ("sFMV",),
    "inlet_seat_leak": ("A_in",),
    "exhaust_seat_leak": ("A_exh",),
    "control_chamber_heat": ("tau_3",),
    "moving_control_volume": ("sV3",),
    "pressure_dependent_discharge": ("kalpha",),
    "critical_pressure_ratio": ("dbcrit",),
    "piston_friction": ("F_PV", "S_PV"),
    "flow_force": ("cflow",),
    "local_gas_speed": ("a1", "a2"),
    "seat_leak": ("A_PV",),
    "circuit_leak": ("A_circuit",),
    "output_chamber_heat": ("tau_2",),
    "output_pipe": ("s_pipe", "A_pipe"),
    "supply_restriction": ("z_supply",),
    "pressure_sensor_lag": ("tau_p2", "tau_p3"),
    "pressure_sensor_bias": ("b_p2", "b_p3"),
    "current_sensor_gain": ("g_I",),
    "command_delay": ("t_delay",),
}
"""Effects by name, with the parameters that size them (epv_env.plant.parameters); all 0 is off.

Not in `Effects`: the bounce, which acts where a stop is met (integrate.py), the delay (valves.py), and
bias and gain of sensors (readings.py)."""

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

STICKY_STEP = 3e-5
"""Steps shorter than this are asked for by friction so great that a mover chatters as it is let go [s]:
there they are kept while a stop holds it, too."""

STRIBECK_SPEED = 0.05
"""Speed at which half of the break-away excess of the piston's friction is left [m/s]."""

COPPER = 0.00393
"""Relative rise of copper's resistance per kelvin [1/K]."""

COOLING_TIME = 60.0
"""Time constant with which the winding cools [s]."""

FILLING_TIME = 2e-3
"""Time constant with which the pressure before the valve follows the flow through its pipe [s]."""


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
    breakaway_PV: Value
    """Relative excess of that friction at rest [-]."""
    leak_PV: Value
    """Effective area of the shut PV seat [m^2]."""
    leak_circuit: Value
    """Effective area of the circuit's leak [m^2]."""
    eddy: Value
    """Conductance of the shorted turn in the iron, seen from the coil [S]."""
    heating: Value
    """Temperature rise of the winding per energy turned into heat [K/J]."""
    coil_start: Value
    """How warm the winding is at the start [K]: it sets the state, not its rates."""
    warm_3: Value
    """1 where the control chamber's gas temperature is free, 0 where it is T_env [-]."""
    exchange_3: Value
    """Rate at which that temperature relaxes to the wall's [1/s]."""
    warm_2: Value
    """`warm_3` for the output chamber [-]."""
    exchange_2: Value
    """`exchange_3` for the output chamber [1/s]."""
    pipe_on: Value
    """1 where part of the circuit lies behind a pipe, else 0 [-]."""
    pipe_area: Value
    """Effective area of that pipe [m^2]."""
    near_share: Value
    """V2 over its part before the pipe [-]."""
    far_share: Value
    """V2 over its part behind the pipe [-]; 0 without one."""
    supply_loss: Value
    """Pressure lost before the valve, times p1 over the flow squared [Pa^2 s^2/kg^2]."""
    lag_2_on: Value
    """1 where the sensor of p2 lags, else 0 [-]."""
    lag_2_rate: Value
    """Reciprocal of its time constant [1/s]."""
    lag_3_on: Value
    """1 where the sensor of p3 lags, else 0 [-]."""
    lag_3_rate: Value
    """Reciprocal of its time constant [1/s]."""
    steady_step: Value
    """Longest step at which the integrator follows every effect but a clamp and friction [s]."""
    clamp_step: Value
    """Longest step at which it follows the current's decay against a clamp [s]."""
    slow_step_PV: Value
    """Longest step at which it follows the friction of a piston about to stop [s]."""
    slow_step_MV: Value
    """The same of the armature [s]."""


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
def heated(R, coil_heat):
    """Resistance of the warm winding [Ohm] (copper)."""
    return R * (1.0 + COPPER * coil_heat)


@inlined
def coil_current(U, I, R, coil_heat, effects):  # noqa: E741
    """Current at the coil's terminals [A]: I, which makes the flux, and the shorted turn's share.

    The turn carries (dflux/dt)/R_eddy, and dflux/dt is what the resistance leaves of U. A clamp
    conducts one way only: behind it the terminals' current ends at zero, and the turn carries I alone.
    """
    U = coil_voltage(U, I, effects)
    current = (I + effects.eddy * U) / (1.0 + effects.eddy * heated(R, coil_heat))
    blocked = (effects.U_clamp > 0.0) & (current * I < 0.0)
    return 0.0 if blocked else current


@inlined
def flux_rate(U, I, R, effects):  # noqa: E741
    """Rate of the coil's flux linkage [V]; R: resistance of the winding, warm as it is."""
    U = coil_voltage(U, I, effects)
    rate = (U - R * I) / (1.0 + effects.eddy * R)
    blocked = (effects.U_clamp > 0.0) & ((I + effects.eddy * U) * I < 0.0)
    return -I / effects.eddy if blocked else rate


@inlined
def heating_rate(current, R, coil_heat, effects):
    """Rate of the winding's temperature [K/s]."""
    power = heated(R, coil_heat) * current * current
    return effects.heating * power - coil_heat * (1.0 / COOLING_TIME)


@inlined
def chamber_rates(p, heat, RT_V, inflow, outflow, expansion, warm, exchange):
    """Rates of a chamber's pressure [Pa/s] and of its gas's relative temperature rise [1/s].

    First law for air that enters at T_env and leaves as it is, with heat passing to the wall (Newton):
    dp/dt = kappa (R T_env/V (in - (1 + heat) out) - p expansion) - exchange p heat/(1 + heat). RT_V:
    R T_env/V [Pa/kg]. expansion: dV/dt over V [1/s]. warm = 0 holds the gas at T_env.
    """
    isothermal = RT_V * (inflow - outflow) - p * expansion
    lost = exchange * p * heat / (1.0 + heat)
    free = KAPPA * (RT_V * (inflow - (1.0 + heat) * outflow) - p * expansion) - lost
    rate = isothermal + warm * (free - isothermal)
    air_rate = (1.0 + heat) * RT_V * (inflow - outflow) / p
    return rate, warm * (1.0 + heat) * (rate / p + expansion - air_rate)


@inlined
def pipe_rate(inflow, p2_rate, RT_V2, effects):
    """Rate of the far pressure less p2 [Pa/s]; inflow: net, into the part behind the pipe [kg/s]."""
    return effects.pipe_on * (RT_V2 * effects.far_share * inflow - p2_rate)


@inlined
def supply_drop_rate(flow, p1, drop, effects):
    """Rate of the pressure lost before the valve [Pa/s]; it follows zeta flow^2/(2 rho A^2)."""
    steady = min(effects.supply_loss * flow * flow / p1, 0.5 * p1)
    return (steady - drop) * (1.0 / FILLING_TIME)


@inlined
def lag_rate(lag, rate, on, per_time):
    """Rate of a first-order sensor's reading less the pressure, which changes at `rate` [Pa/s]."""
    return -per_time * lag - on * rate


@inlined
def stribeck(v, excess):
    """Friction at a speed relative to Coulomb's [-]: 1 + excess at rest, 1 if fast (Hess, Soom 1990)."""
    relative = v * (1.0 / STRIBECK_SPEED)
    return 1.0 + excess / (1.0 + relative * relative)


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
def friction_step(slow_step, v, sliding_speed):
    """Longest step for friction at a speed [s]: the slope of the curve of `friction` falls with it.

    Half the speed stands for what a step may take from it; nor may friction turn a mover within one.
    """
    relative = abs(v) / sliding_speed
    steeper = 1.0 + 0.25 * relative * relative
    return slow_step * min(steeper * math.sqrt(steeper), 1.0 + 0.5 * relative)


@inlined
def longest_step(U, q, effects, free_PV, free_MV):
    """Longest step that the effects allow at present [s]; friction asks for none while a stop holds."""
    clamped = (U <= OFF_VOLTAGE) & (abs(q.I) > NO_CURRENT)
    step = min(effects.steady_step, effects.clamp_step if clamped else effects.steady_step)
    step_PV = friction_step(effects.slow_step_PV, q.vPV, SLIDING_SPEED_PV)
    step_MV = friction_step(effects.slow_step_MV, q.vMV, SLIDING_SPEED_MV)
    bound_PV = (free_PV > 0.0) | (effects.slow_step_PV < STICKY_STEP)
    bound_MV = (free_MV > 0.0) | (effects.slow_step_MV < STICKY_STEP)
    step = min(step, step_PV if bound_PV else step)
    return min(step, step_MV if bound_MV else step)
