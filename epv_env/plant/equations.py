"""The state equations of the valve, each once (report eqs 5-16, corrected).

Corrections and symbols: docs/explanation/plant-model.md.

Everything else - simulation, calibration, environment, diagnosis, SciPy reference - calls these.
SI units. Functions take named tuples of numbers (one valve) and are inlined into the kernels of
integrate.py.
"""

import math
from typing import NamedTuple

from epv_env.plant.effects.chambers import chamber_rates, pipe_rate
from epv_env.plant.effects.coil import coil_current, flux_rate, heated, heating_rate
from epv_env.plant.effects.flows import discharge, effective_seat_diameter, supply_drop_rate
from epv_env.plant.effects.magnet import saturated_force, saturation_level, steepness
from epv_env.plant.effects.measurement import lag_rate
from epv_env.plant.effects.movers import (
    SLIDING_SPEED_MV,
    SLIDING_SPEED_PV,
    friction,
    stop_friction,
    stribeck,
)
from epv_env.plant.effects.registry import with_laws
from epv_env.plant.effects.seats import opened
from epv_env.plant.primitives import QUARTER_PI, Value, inlined, mass_flux, replacing


class State(NamedTuple):
    """State q (eq. 1), the supply pressure, what has passed through so far, and what effects add.

    The report's seven states are p2 .. I. p1 is the input chamber's pressure, a disturbance in the
    report and here a state because a reservoir sags. The next four are running integrals, carried so
    that mass and energy balances can be read off exactly. The last belong to effects (effects/); but
    for I_coil they are departures from the nominal valve, and rest at zero without their effect.
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
    """Solenoid current, as far as it makes flux [A]."""
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
    I_coil: Value = 0.0
    """Current at the coil's terminals at the end of the last step [A]; I but for eddy currents."""
    coil_heat: Value = 0.0
    """How far the winding is warmer than where its resistance is R [K]."""
    heat_3: Value = 0.0
    """Relative rise of the control chamber's gas temperature above T_env [-]."""
    heat_2: Value = 0.0
    """The same for the output chamber [-]."""
    far_pressure: Value = 0.0
    """Pressure of the circuit behind its pipe, less p2 [Pa]."""
    supply_drop: Value = 0.0
    """Pressure lost between the sensor of p1 and the valve [Pa]."""
    lag_2: Value = 0.0
    """What the sensor of p2 reads, less p2 [Pa]."""
    lag_3: Value = 0.0
    """What the sensor of p3 reads, less p3 [Pa]."""


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
    air_3: Value = 0.0
    """Air forced into the control chamber [kg/s]; this and the next are for diagnosis, and act in the
    extended kernel only."""
    force_PV: Value = 0.0
    """Force on the piston, opening positive [N]."""
    force_MV: Value = 0.0
    """Force on the armature, pull-in positive [N]."""


class Coefficients(NamedTuple):
    """Parameters as the equations use them: report symbols, and products folded once per valve."""

    cPV: Value
    """Stiffness of the PV spring [N/m]."""
    xPV0: Value
    """Preload stroke of the PV spring [m]."""
    kPV: Value
    """Damping of the piston [N s/m]."""
    xPVmax: Value
    """Stroke of the piston [m]."""
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
    """Stiffness of the MV spring [N/m]."""
    xMV0: Value
    """Preload stroke of the MV spring [m]."""
    kMV: Value
    """Damping of the armature [N s/m]."""
    xMVmax: Value
    """Stroke of the armature [m]."""
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
    """Resistance of the cold winding [Ohm]."""
    RML: Value
    """Reluctance of the iron [A/(V s)]."""
    gap_reluctance: Value
    """1/(mu0 A_MB): reluctance per metre of air gap [A/(V s m)]."""
    N_squared: Value
    """Turns squared [-]."""
    N_squared_inverse: Value
    """Reciprocal of the squared turns [-]."""
    RT_V2: Value
    """R T_env / V2 [Pa/kg]."""
    RT_V3: Value
    """R T_env / V3 [Pa/kg]."""
    RT_V1: Value
    """R T_env / V1 of the reservoirs [Pa/kg]; 0 for a supply that does not sag."""
    inverse_sqrt_RT: Value
    """1/sqrt(R T_env) [s/m]."""
    p_env: Value
    """Ambient pressure [Pa absolute]."""


_with_supply = replacing(State, "p1")


@inlined
def piston_friction(q, effects):
    """Size of the piston's friction [N]; greatest at rest."""
    return effects.friction_PV * stribeck(q.vPV, effects.breakaway_PV)


@inlined
def piston_force(q, c, effects, extended):
    """Net force on the PV piston, opening positive [N] (eq. 22; eq. 9 with the cone effect).

    The control pressure p3 acts on the whole back; p1 on the ring, p2 on the seat.
    """
    seat = c.seat_diameter
    if extended is not None:
        seat = effective_seat_diameter(q.xPV, q.p1, q.p2, seat, effects)
    seat_area = QUARTER_PI * seat * seat
    pressure = (q.p1 - q.p3) * c.piston_area - (q.p1 - q.p2) * seat_area
    force = pressure - c.cPV * (q.xPV + c.xPV0) - c.kPV * q.vPV
    if extended is not None:
        force -= effects.flow_force * c.curtain_PV * q.xPV * (q.p1 - q.p2)
        size = piston_friction(q, effects)
        force = friction(force, q.xPV, q.vPV, c.xPVmax, size, SLIDING_SPEED_PV)
    return force


@inlined
def reluctance(q, c):
    """Rm of the magnetic loop [A/(V s)]: the air gap closes as the armature is pulled in.

    A step on trial may run past the stop; the bound, never met within the strokes, keeps it from zero.
    """
    return max(c.RML + (c.xMVmax - q.xMV) * c.gap_reluctance, 0.5 * c.RML)


@inlined
def reluctance_inverse(q, c):
    """1/Rm of the magnetic loop [V s/A]."""
    return 1.0 / reluctance(q, c)


@inlined
def armature_force(q, c, inverse_Rm, effects, extended):
    """Net force on the MV armature, pull-in positive [N] (eq. 11)."""
    current, half = q.I, 0.5
    if extended is not None:
        current = q.I + effects.I_rem
        half = saturated_force(saturation_level(current, inverse_Rm, effects.saturation))
    flux_linkage = current * inverse_Rm
    magnetic = half * c.N_squared * flux_linkage * flux_linkage * c.gap_reluctance
    force = magnetic - c.cMV * (q.xMV + c.xMV0) - c.kMV * q.vMV
    if extended is not None:
        force += effects.inlet_area * (q.p1 - q.p3) - effects.exhaust_area * (q.p3 - c.p_env)
        force = friction(force, q.xMV, q.vMV, c.xMVmax, effects.friction_MV, SLIDING_SPEED_MV)
    return force


@inlined
def current_rate(q, u, c, inverse_Rm, effects, extended):
    """dI/dt [A/s] (eq. 12 with the sign of docs/explanation/plant-model.md, correction 6)."""
    current, per_inductance, saturated = q.I, c.N_squared_inverse * reluctance(q, c), 1.0
    if extended is not None:
        current = q.I + effects.I_rem
        level = saturation_level(current, inverse_Rm, effects.saturation)
        steep = steepness(level, effects.saturation_knee)
        per_inductance *= steep
        saturated = steep / steepness(level, 0.0)  # the armature's EMF belongs to its force
        linkage_rate = flux_rate(u.U, q.I, heated(c.R, q.coil_heat), effects)
    else:
        linkage_rate = u.U - c.R * q.I
    motion = current * q.vMV * c.gap_reluctance * inverse_Rm * saturated
    return linkage_rate * per_inductance - motion


@inlined
def flow_PV(q, c, effects, extended):
    """Mass flow from the input to the output chamber through the PV seat [kg/s] (eq. 6)."""
    area, share = c.curtain_PV * q.xPV, 1.0
    if extended is not None:
        area = area * discharge(q.p1, q.p2, effects) + effects.leak_PV
        share = 1.0 - effects.drop_deficit
    return area * mass_flux(q.p1, q.p2, c.inverse_sqrt_RT, share)


@inlined
def flow_inlet(q, c, effects, extended):
    """Mass flow from the input to the control chamber [kg/s] (eq. 7): smaller of curtain, orifice."""
    area, share = min(c.curtain_in * q.xMV, c.orifice_in), 1.0
    if extended is not None:
        area = opened(area, c.orifice_in, effects.leak_inlet, effects.beside_inlet)
        share = 1.0 - effects.drop_deficit
    return area * mass_flux(q.p1, q.p3, c.inverse_sqrt_RT, share)


@inlined
def flow_exhaust(q, c, effects, extended):
    """Mass flow from the control chamber to ambient [kg/s] (the exhaust that eq. 7 leaves out)."""
    area, share = min(c.curtain_exh * (c.xMVmax - q.xMV), c.orifice_exh), 1.0
    inverse_sqrt_RT = c.inverse_sqrt_RT
    if extended is not None:
        area = opened(area, c.orifice_exh, effects.leak_exhaust, effects.beside_exhaust)
        share = 1.0 - effects.drop_deficit
        inverse_sqrt_RT /= math.sqrt(1.0 + q.heat_3)
    return area * mass_flux(q.p3, c.p_env, inverse_sqrt_RT, share)


@inlined
def flow_circuit_leak(q, c, effects, extended):
    """Mass flow from the circuit to ambient through its leak [kg/s]."""
    if extended is not None:
        share = 1.0 - effects.drop_deficit
        return effects.leak_circuit * mass_flux(q.p2, c.p_env, c.inverse_sqrt_RT, share)
    return 0.0


@inlined
def flow_pipe(q, c, effects):
    """Mass flow from the output chamber through the pipe to the rest of the circuit [kg/s]."""
    return effects.pipe_area * mass_flux(q.p2, q.p2 + q.far_pressure, c.inverse_sqrt_RT)


@inlined
def control_chamber_rates(q, c, inflow, outflow, effects):
    """dp3/dt [Pa/s] and the rate of heat_3 [1/s]: the piston may sweep the chamber, its gas warm up.

    A tenth of the chamber is left, whatever the parameters say, so that its pressure stays finite.
    """
    left = max(1.0 - effects.swept * q.xPV, 0.1)
    expansion = -effects.swept * q.vPV / left
    return chamber_rates(
        q.p3, q.heat_3, c.RT_V3 / left, inflow, outflow, expansion, effects.warm_3, effects.exchange_3
    )


@inlined
def effect_rates(q, u, c, effects, through_PV, inlet, exhaust, leak):
    """dp2/dt and dp3/dt with effects [Pa/s], and the rates of the effects' own states."""
    pipe = flow_pipe(q, c, effects)
    consumed = leak + u.sigma_S * (1.0 - effects.pipe_on)
    p2_rate, heat_2_rate = chamber_rates(
        q.p2, q.heat_2, c.RT_V2 * effects.near_share, through_PV, pipe + consumed, 0.0,
        effects.warm_2, effects.exchange_2,
    )  # fmt: skip
    p3_rate, heat_3_rate = control_chamber_rates(q, c, inlet + u.air_3, exhaust, effects)
    current = coil_current(u.U, q.I, c.R, q.coil_heat, effects)
    return (
        p2_rate,
        p3_rate,
        heating_rate(current, c.R, q.coil_heat, effects),
        heat_3_rate,
        heat_2_rate,
        pipe_rate(pipe - u.sigma_S, p2_rate, c.RT_V2, effects),
        supply_drop_rate(
            effects.supply_PV * through_PV + effects.supply_MV * inlet, q.p1, q.supply_drop, effects
        ),
        lag_rate(q.lag_2, p2_rate, effects.lag_2_on, effects.lag_2_rate),
        lag_rate(q.lag_3, p3_rate, effects.lag_3_on, effects.lag_3_rate),
        current,
    )


@inlined
def derivative(q, u, c, effects, free_PV, free_MV, extended):
    """Rates of all states (eqs 5-12), and the two forces that decide whether a stop holds.

    These forces include the friction of a mover at rest on a stop; a mover that is let go has none yet.

    free_PV, free_MV: 1.0 where the mover may move, 0.0 where a stop holds it. extended: None, for
    which numba drops the effects before it types them; FEW_LAWS where no other laws are in use; or
    True. Returns (State of rates, piston force, armature force).
    """
    feed_MV = q
    if extended is not None:
        feed_MV = _with_supply(q, q.p1 - effects.supply_MV * q.supply_drop)
        q = _with_supply(q, q.p1 - effects.supply_PV * q.supply_drop)
        effects = with_laws(q, effects, extended)
    force_PV = piston_force(q, c, effects, extended)
    inverse_Rm = reluctance_inverse(q, c)
    force_MV = armature_force(feed_MV, c, inverse_Rm, effects, extended)
    through_PV = flow_PV(q, c, effects, extended)
    inlet = flow_inlet(feed_MV, c, effects, extended)
    exhaust = flow_exhaust(q, c, effects, extended)
    leak = flow_circuit_leak(q, c, effects, extended)
    moving_PV, moving_MV = force_PV, force_MV
    if extended is not None:
        force_PV += u.force_PV
        force_MV += u.force_MV
        moving_PV = force_PV + stop_friction(q.xPV, q.vPV, c.xPVmax, piston_friction(q, effects))
        moving_MV = force_MV + stop_friction(q.xMV, q.vMV, c.xMVmax, effects.friction_MV)
        (
            p2_rate, p3_rate, coil_heat_rate, heat_3_rate, heat_2_rate, far_rate, drop_rate, lag_2_rate,
            lag_3_rate, current,
        ) = effect_rates(q, u, c, effects, through_PV, inlet, exhaust, leak)  # fmt: skip
    else:
        p2_rate = c.RT_V2 * (through_PV - u.sigma_S)
        p3_rate = c.RT_V3 * (inlet - exhaust)
        coil_heat_rate = heat_3_rate = heat_2_rate = far_rate = drop_rate = 0.0
        lag_2_rate = lag_3_rate = 0.0
        current = q.I
    rates = State(
        p2=p2_rate,
        p3=p3_rate,
        xPV=q.vPV * free_PV,
        vPV=moving_PV * c.mPV_inverse * free_PV,
        xMV=q.vMV * free_MV,
        vMV=moving_MV * c.mMV_inverse * free_MV,
        I=current_rate(q, u, c, inverse_Rm, effects, extended),
        p1=u.p1_slope + c.RT_V1 * (u.refill - through_PV - inlet),
        air_in_PV=through_PV,
        air_in_MV=inlet,
        air_vented=exhaust + leak,
        coil_energy=u.U * current,
        I_coil=0.0,
        coil_heat=coil_heat_rate,
        heat_3=heat_3_rate,
        heat_2=heat_2_rate,
        far_pressure=far_rate,
        supply_drop=drop_rate,
        lag_2=lag_2_rate,
        lag_3=lag_3_rate,
    )
    return rates, force_PV, force_MV
