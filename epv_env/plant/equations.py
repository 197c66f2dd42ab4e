"""The state equations of the valve, each once (report eqs 5-16 as corrected in docs/model.md).

Everything else - simulation, calibration, environment, diagnosis, SciPy reference - calls these.
SI units; symbols are those of docs/model.md. Functions take named tuples of numbers (one valve) and
are inlined into the kernels of integrate.py.
"""

from typing import NamedTuple

from epv_env.plant.compiled import inlined
from epv_env.plant.effects import (
    SLIDING_SPEED_MV,
    SLIDING_SPEED_PV,
    coil_voltage,
    discharge,
    effective_seat_diameter,
    friction,
    opened,
    saturated_force,
    saturation_level,
)
from epv_env.plant.flow import mass_flux
from epv_env.plant.values import Value

QUARTER_PI = 0.7853981633974483


class State(NamedTuple):
    """State q (eq. 1), the supply pressure, and what has passed through so far.

    The report's seven states are p2 .. I. p1 is the input chamber's pressure, a disturbance in the
    report and here a state because a reservoir sags. The last four are running integrals, carried so
    that mass and energy balances can be read off exactly.
    """

    p2: Value
    """Output chamber (circuit) pressure [Pa absolute]."""
    p3: Value
    """Control chamber pressure [Pa absolute]."""
    xPV: Value
    """Stroke of the protection valve piston, 0 = shut [m]."""
    vPV: Value
    """Speed of the piston [m/s]."""
    xMV: Value
    """Stroke of the magnet valve armature, xMVmax = pulled in [m]."""
    vMV: Value
    """Speed of the armature [m/s]."""
    I: Value  # noqa: E741 - the report's symbol
    """Solenoid current [A]."""
    p1: Value
    """Input chamber pressure [Pa absolute]."""
    air_in_PV: Value
    """Air passed from the input to the output chamber [kg]."""
    air_in_MV: Value
    """Air passed from the input to the control chamber [kg]."""
    air_vented: Value
    """Air passed from the control chamber, and through a leak of the circuit, to ambient [kg]."""
    coil_energy: Value
    """Electrical energy taken by the coil [J]."""


class Inputs(NamedTuple):
    """What acts on the valve from outside, constant or linear in time over one period."""

    U: Value
    """Solenoid voltage [V]."""
    sigma_S: Value
    """Air consumed from the circuit [kg/s]."""
    p1_slope: Value
    """Imposed rate of the supply pressure, for a recorded p1 [Pa/s]."""
    refill: Value
    """Air that the compressor delivers to the reservoirs [kg/s]."""


class Coefficients(NamedTuple):
    """Parameters as the equations use them: report symbols, and products folded once per valve."""

    cPV: Value
    xPV0: Value
    kPV: Value
    xPVmax: Value
    ePV: Value
    """Coefficient of restitution of the piston's stops [-]."""
    piston_area: Value
    """pi/4 d1^2 [m^2]."""
    seat_diameter: Value
    """d2 [m]."""
    mPV_inverse: Value
    """1/mPV [1/kg]."""
    curtain_PV: Value
    """alphaPV pi d2: effective opening per stroke [m]."""
    cMV: Value
    xMV0: Value
    kMV: Value
    xMVmax: Value
    eMV: Value
    """Coefficient of restitution of the armature's stops [-]."""
    mMV_inverse: Value
    """1/mMV [1/kg]."""
    curtain_in: Value
    """alphaMV pi dMVin [m]."""
    orifice_in: Value
    """alphaMV pi/4 dMVin^2 [m^2]."""
    curtain_exh: Value
    """alphaMV pi dMVexh [m]."""
    orifice_exh: Value
    """alphaMV pi/4 dMVexh^2 [m^2]."""
    kink_in: Value
    """Stroke above which the inlet's bore is the smaller area [m]."""
    kink_exh: Value
    """Stroke below which the exhaust's bore is the smaller area [m]."""
    R: Value
    RML: Value
    gap_reluctance: Value
    """1/(mu0 A_MB): reluctance per metre of air gap [A/(V s m)]."""
    N_squared: Value
    """Turns squared [-]."""
    N_squared_inverse: Value
    RT_V2: Value
    """R T_env / V2 [Pa/kg]."""
    RT_V3: Value
    """R T_env / V3 [Pa/kg]."""
    RT_V1: Value
    """R T_env / V1 of the reservoirs [Pa/kg]; 0 for a supply that does not sag."""
    inverse_sqrt_RT: Value
    """1/sqrt(R T_env) [s/m]."""
    p_env: Value


@inlined
def piston_force(q, c, effects, extended):
    """Net force on the PV piston, opening positive [N] (eq. 22; eq. 9 with the cone effect).

    The control pressure p3 acts on the whole back; p1 on the ring, p2 on the seat.
    """
    seat = c.seat_diameter
    if extended:
        seat = effective_seat_diameter(q.xPV, q.p1, q.p2, seat, effects)
    seat_area = QUARTER_PI * seat * seat
    pressure = (q.p1 - q.p3) * c.piston_area - (q.p1 - q.p2) * seat_area
    force = pressure - c.cPV * (q.xPV + c.xPV0) - c.kPV * q.vPV
    if extended:
        force -= effects.flow_force * c.curtain_PV * q.xPV * (q.p1 - q.p2)
        force = friction(force, q.xPV, q.vPV, c.xPVmax, effects.friction_PV, SLIDING_SPEED_PV)
    return force


@inlined
def reluctance_inverse(q, c):
    """1/Rm of the magnetic loop [V s/A]: the air gap closes as the armature is pulled in.

    A step on trial may run past the stop; the bound, never met within the strokes, keeps it from a pole.
    """
    return 1.0 / max(c.RML + (c.xMVmax - q.xMV) * c.gap_reluctance, 0.5 * c.RML)


@inlined
def armature_force(q, c, inverse_Rm, effects, extended):
    """Net force on the MV armature, pull-in positive [N] (eq. 11)."""
    current, half = q.I, 0.5
    if extended:
        current = q.I + effects.I_rem
        half = saturated_force(saturation_level(current, inverse_Rm, effects))
    flux_linkage = current * inverse_Rm
    magnetic = half * c.N_squared * flux_linkage * flux_linkage * c.gap_reluctance
    force = magnetic - c.cMV * (q.xMV + c.xMV0) - c.kMV * q.vMV
    if extended:
        force += effects.inlet_area * (q.p1 - q.p3) - effects.exhaust_area * (q.p3 - c.p_env)
        force = friction(force, q.xMV, q.vMV, c.xMVmax, effects.friction_MV, SLIDING_SPEED_MV)
    return force


@inlined
def current_rate(q, u, c, inverse_Rm, effects, extended):
    """dI/dt [A/s] (eq. 12 with the sign of docs/model.md, correction 6)."""
    U, current, per_inductance = u.U, q.I, c.N_squared_inverse / inverse_Rm
    if extended:
        U = coil_voltage(u.U, q.I, effects)
        current = q.I + effects.I_rem
        flattened = 1.0 + saturation_level(current, inverse_Rm, effects)
        per_inductance *= flattened * flattened
    motion = current * q.vMV * c.gap_reluctance * inverse_Rm
    return (U - c.R * q.I) * per_inductance - motion


@inlined
def flow_PV(q, c, effects, extended):
    """Mass flow from the input to the output chamber through the PV seat [kg/s] (eq. 6)."""
    area, share = c.curtain_PV * q.xPV, 1.0
    if extended:
        area = area * discharge(q.p1, q.p2, effects) + effects.leak_PV
        share = 1.0 - effects.drop_deficit
    return area * mass_flux(q.p1, q.p2, c.inverse_sqrt_RT, share)


@inlined
def flow_inlet(q, c, effects, extended):
    """Mass flow from the input to the control chamber [kg/s] (eq. 7): smaller of curtain, orifice."""
    area, share = min(c.curtain_in * q.xMV, c.orifice_in), 1.0
    if extended:
        area = opened(area, c.orifice_in, effects.leak_inlet)
        share = 1.0 - effects.drop_deficit
    return area * mass_flux(q.p1, q.p3, c.inverse_sqrt_RT, share)


@inlined
def flow_exhaust(q, c, effects, extended):
    """Mass flow from the control chamber to ambient [kg/s] (the exhaust that eq. 7 leaves out)."""
    area, share = min(c.curtain_exh * (c.xMVmax - q.xMV), c.orifice_exh), 1.0
    if extended:
        area = opened(area, c.orifice_exh, effects.leak_exhaust)
        share = 1.0 - effects.drop_deficit
    return area * mass_flux(q.p3, c.p_env, c.inverse_sqrt_RT, share)


@inlined
def flow_circuit_leak(q, c, effects, extended):
    """Mass flow from the circuit to ambient through its leak [kg/s]."""
    if extended:
        share = 1.0 - effects.drop_deficit
        return effects.leak_circuit * mass_flux(q.p2, c.p_env, c.inverse_sqrt_RT, share)
    return 0.0


@inlined
def control_pressure_rate(q, c, mass_rate, effects, extended):
    """dp3/dt for air coming in at mass_rate [Pa/s] (eq. 7); the piston may sweep the chamber.

    A tenth of the chamber is left, whatever the parameters say, so that its pressure stays finite.
    """
    if extended:
        left = max(1.0 - effects.swept * q.xPV, 0.1)
        return (c.RT_V3 * mass_rate + effects.swept * q.vPV * q.p3) / left
    return c.RT_V3 * mass_rate


@inlined
def derivative(q, u, c, effects, free_PV, free_MV, extended):
    """Rates of all states (eqs 5-12), and the two forces that decide whether a stop holds.

    free_PV, free_MV: 1.0 where the mover may move, 0.0 where a stop holds it. extended: a literal
    bool; False compiles the effects away. Returns (State of rates, piston force, armature force).
    """
    force_PV = piston_force(q, c, effects, extended)
    inverse_Rm = reluctance_inverse(q, c)
    force_MV = armature_force(q, c, inverse_Rm, effects, extended)
    through_PV = flow_PV(q, c, effects, extended)
    inlet = flow_inlet(q, c, effects, extended)
    exhaust = flow_exhaust(q, c, effects, extended)
    leak = flow_circuit_leak(q, c, effects, extended)
    rates = State(
        p2=c.RT_V2 * (through_PV - leak - u.sigma_S),
        p3=control_pressure_rate(q, c, inlet - exhaust, effects, extended),
        xPV=q.vPV * free_PV,
        vPV=force_PV * c.mPV_inverse * free_PV,
        xMV=q.vMV * free_MV,
        vMV=force_MV * c.mMV_inverse * free_MV,
        I=current_rate(q, u, c, inverse_Rm, effects, extended),
        p1=u.p1_slope + c.RT_V1 * (u.refill - through_PV - inlet),
        air_in_PV=through_PV,
        air_in_MV=inlet,
        air_vented=exhaust + leak,
        coil_energy=u.U * q.I,
    )
    return rates, force_PV, force_MV
