"""The bench's own forms of the effects, unlike those that the diagnosis fits.

If the data were made with the fitted forms, the check would be too easy. Two things differ: each size
depends on the state by a share d of itself, as in a real valve (comments say why), and two effects may
follow another law. The supply's drop is then that of the flow at once, which agrees at a steady flow;
saturation follows Langevin's curve (1905), the anhysteretic one of Jiles and Atherton (1986), which
agrees at low and at high currents. Without the effect both are the plant. Errors of sensors and the
command's delay deviate in bench.py.
"""

import math
from collections.abc import Collection

import numba
import numpy as np

from epv_env.common.units import BAR
from epv_env.plant.effects.coil import OFF_VOLTAGE, coil_current, heated
from epv_env.plant.effects.magnet import saturated_force, saturation_level
from epv_env.plant.effects.registry import Effects
from epv_env.plant.equations import (
    State,
    derivative,
    flow_exhaust,
    flow_inlet,
    flow_PV,
    reluctance_inverse,
)
from epv_env.plant.lanes import coefficients_at, effects_at, inputs_at, state_at, store_state
from epv_env.plant.primitives import FLAGS, inlined, replacing, source_digest
from tests.reference.hybrid_automaton import RightHandSide

FILM_THICKNESS = 20e-6
"""Thickness of the air film that an armature squeezes out as it lands [m]: slow landings bounce less."""

FILM_SPEED = 0.1
"""Speed that the film takes from a bouncing armature on each way through it, at d eMV = 1 [m/s]."""

IRON_TIME_CONSTANT = 1.0
"""Time constant with which the winding's heat flows into the iron, at d = 1 [s]: it is not alone."""

INSTANT_DROP, LANGEVIN = "supply_restriction", "magnetic_saturation"

OTHER_FORMS = (INSTANT_DROP, LANGEVIN)
"""Effects that have another form."""

HALVINGS = 40
"""Bisections for a root: the drop is then exact to 1e-6 Pa, a level of saturation to 1e-10."""

SERIES_LEVEL = 0.03
"""Level of saturation below which series replace the Langevin function, which cancels there [-]."""

LEVEL_RATIO = 2.0
"""Largest Froelich level that gives the force of a Langevin level, relative to it [-]."""

_with_electric = replacing(
    Effects, "eddy", "U_clamp", "U_drop", "saturation", "I_rem", "friction_MV",
    "inlet_area", "exhaust_area",
)  # fmt: skip
_with_gas = replacing(
    Effects, "leak_inlet", "leak_exhaust", "exchange_3", "swept", "drop_deficit", "leak_PV",
    "leak_circuit", "exchange_2", "pipe_area", "supply_loss",
)  # fmt: skip
_with_piston = replacing(
    Effects, "discharge_slope", "friction_PV", "flow_force", "a1", "a2", "lag_2_rate", "lag_3_rate"
)
_with_supply = replacing(State, "p1")
_with_drop = replacing(State, "supply_drop")
_with_saturation = replacing(Effects, "saturation")
_with_rates = replacing(State, "vMV", "coil_heat", "I", "supply_drop")


@inlined
def _solenoid_sizes(q, u, c, e, d):
    """Sizes of the solenoid's and the armature's effects."""
    closed = 2.0 * q.xMV / c.xMVmax - 1.0
    level = saturation_level(q.I, reluctance_inverse(q, c), e.saturation)
    saturated = 1.0 + d * (level - 0.3) / (level + 0.3)
    steady = max(u.U - e.U_drop, OFF_VOLTAGE) / heated(c.R, q.coil_heat)
    return _with_electric(
        e,
        e.eddy * (1.0 + d * closed),  # a closed iron path links the shorted turn better
        e.U_clamp * (1.0 + d * (abs(q.I) / 0.3 - 1.0)),  # a diode's or Zener's slope resistance
        e.U_drop * (1.0 + d * (abs(q.I) / steady - 1.0)),  # part of the drop is resistive
        e.saturation * saturated,  # iron stays linear longer, then bends sharper
        e.I_rem * (1.0 + d * closed),  # an open gap demagnetises
        e.friction_MV * (1.0 + d * (abs(q.vMV) / 0.3 - 1.0)),  # a viscous share
        e.inlet_area * (1.0 - d * closed),  # an open seat's jet sucks
        e.exhaust_area * (1.0 + d * closed),
    )


@inlined
def _gas_sizes(q, c, e, d):
    """Sizes of the effects of flows and chambers."""
    opened = 2.0 * q.xPV / c.xPVmax - 1.0
    through = abs(flow_PV(q, c, e, True))
    inlet = abs(flow_inlet(q, c, e, True))
    control = inlet + abs(flow_exhaust(q, c, e, True))
    pipe = abs(q.far_pressure)
    supply = max((through + inlet) / 0.02, 1e-3)
    return _with_gas(
        e,
        e.leak_inlet * (1.0 + d * (abs(q.p1 - q.p3) / (6.0 * BAR) - 1.0)),  # pressure lifts the seat
        e.leak_exhaust * (1.0 + d * (abs(q.p3 - c.p_env) / (6.0 * BAR) - 1.0)),
        e.exchange_3 * (1.0 + d * (2.0 * control / (control + 3e-4) - 1.0)),  # moving gas exchanges more
        e.swept * (1.0 + d * opened),  # a piston with a shoulder
        e.drop_deficit * (1.0 + d * opened),  # the ratio falls as the seat opens
        e.leak_PV * (1.0 + d * (abs(q.p1 - q.p2) / (4.0 * BAR) - 1.0)),
        e.leak_circuit * (1.0 + d * (abs(q.p2 - c.p_env) / (6.0 * BAR) - 1.0)),
        e.exchange_2 * (1.0 + d * (2.0 * through / (through + 0.02) - 1.0)),
        e.pipe_area * (1.0 + d * (1.0 - 2.0 * pipe / (pipe + 0.2 * BAR))),  # wall friction, too
        e.supply_loss * supply ** (-2.0 * d),  # smooth pipes: exponent below 2 (Blasius)
    )


@inlined
def _piston_sizes(q, c, e, d):
    """Sizes of the effects of the piston, its seat and the pressure sensors."""
    opened = 2.0 * q.xPV / c.xPVmax - 1.0
    lip = (q.p3 - c.p_env) / (6.0 * BAR) - 1.0
    return _with_piston(
        e,
        e.discharge_slope * (1.0 + d * (3.0 * (1.0 - min(q.p2 / q.p1, 1.0)) - 1.0)),
        e.friction_PV * (1.0 + d * (lip + abs(q.vPV) / 0.2 - 0.5)),  # the lip's pressure, viscosity
        e.flow_force * (1.0 - d * opened),  # the jet's angle grows with the stroke
        e.a1 * (1.0 + d * opened),  # the cone widens
        e.a2 * (1.0 + d * opened),
        e.lag_2_rate * (1.0 - d * q.lag_2 / (abs(q.lag_2) + 5e3)),  # empties slower than it fills
        e.lag_3_rate * (1.0 - d * q.lag_3 / (abs(q.lag_3) + 5e3)),
    )


@inlined
def deviating_sizes(q, u, c, e, d):
    """The sizes of the effects at a state.

    q: state. u: inputs. c: coefficients. e: sizes of the fitted forms. d: relative deviation of the
    forms [-].
    """
    at_valve = _with_supply(q, q.p1 - q.supply_drop)
    return _piston_sizes(at_valve, c, _gas_sizes(at_valve, c, _solenoid_sizes(q, u, c, e, d), d), d)


@inlined
def film_rate(q, c, e):
    """Rate at which the squeezed film slows a bouncing armature, relative to its speed [1/s]."""
    low = math.exp(-max(q.xMV, 0.0) / FILM_THICKNESS)
    high = math.exp(-max(c.xMVmax - q.xMV, 0.0) / FILM_THICKNESS)
    return e.restitution_MV * FILM_SPEED / FILM_THICKNESS * (low + high)


@numba.njit(**FLAGS)
def _drop_of_flow(q, u, c, e, d, drop):
    """Pressure [Pa] that the flow loses before the valve if the valve sees p1 less `drop` [Pa]."""
    sizes = deviating_sizes(_with_drop(q, drop), u, c, e, d)
    seen = _with_supply(q, q.p1 - drop)
    flow = max(flow_PV(seen, c, sizes, True) + flow_inlet(seen, c, sizes, True), 0.0)
    return sizes.supply_loss * flow * flow / seen.p1


@numba.njit(**FLAGS)
def instant_drop(q, u, c, e, d):
    """Pressure lost before the valve [Pa] that belongs to the flow at this instant.

    The loss falls as the drop rises, so there is one root. At most a third of p1 is lost, as at the
    limit of the fitted form: half of what the valve sees.

    q: state. u: inputs. c: coefficients. e: sizes of the fitted forms. d: relative deviation of the
    forms [-].
    """
    low, high = 0.0, q.p1 / 3.0
    if _drop_of_flow(q, u, c, e, d, low) <= 0.0:
        return 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _drop_of_flow(q, u, c, e, d, middle) > middle:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@inlined
def langevin(y):
    """Langevin function coth y - 1/y for y > 0 [-]."""
    return 1.0 / math.tanh(y) - 1.0 / y


@inlined
def langevin_force(u):
    """Magnetic force relative to N^2 I^2/(Rm^2 mu0 A) at a level of saturation u: 1/2 at 0 [-].

    (u L(3u) - G(u))/u^2 with the Langevin function L and its coenergy G = ln(sinh(3u)/(3u))/3.
    """
    if u < SERIES_LEVEL:
        return 0.5 - u * u * (0.45 - u * u * (3.0 / 7.0))
    y = 3.0 * u
    coenergy = (y + math.log((1.0 - math.exp(-2.0 * y)) / (2.0 * y))) / 3.0
    return (u * langevin(y) - coenergy) / (u * u)


@inlined
def langevin_slope(u):
    """Differential permeance at a level of saturation u relative to that at 0: 3 L'(3u) [-]."""
    if u < SERIES_LEVEL:
        return 1.0 - u * u * (1.8 - u * u * (18.0 / 7.0))
    y = 3.0 * u
    decay = math.exp(-y)
    sinh = 0.5 * (1.0 - decay * decay) / decay
    return 3.0 * (1.0 / (y * y) - 1.0 / (sinh * sinh))


@numba.njit(**FLAGS)
def level_of_force(u):
    """Level of the fitted curve at which its force is that of the Langevin curve at level u [-]."""
    force = langevin_force(u)
    low, high = 0.0, LEVEL_RATIO * u
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if saturated_force(middle) > force:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@inlined
def langevin_size(q, c, e):
    """Size of saturation [1/(V s)] with which the fitted form's force is that of the Langevin curve.

    q: state. c: coefficients. e: sizes of the effects.
    """
    level = saturation_level(q.I + e.I_rem, reluctance_inverse(q, c), e.saturation)
    return e.saturation * level_of_force(level) / level if level > 0.0 else e.saturation


@inlined
def langevin_current_rate(q, c, e, size, rate):
    """dI/dt [A/s] on the Langevin curve.

    size: of saturation, of `langevin_size`. rate: dI/dt of the fitted form with this size [A/s]. Voltage
    acts through the differential inductance, which is the curve's own; motion acts alike in both.
    """
    inverse_Rm = reluctance_inverse(q, c)
    current = q.I + e.I_rem
    motion = current * q.vMV * c.gap_reluctance * inverse_Rm
    level = saturation_level(current, inverse_Rm, e.saturation)
    fitted = 1.0 + (size / e.saturation * level if e.saturation > 0.0 else 0.0)
    return (rate + motion) / (fitted * fitted * langevin_slope(level)) - motion


def _compile(digest: str):
    """Rates and terminal currents as compiled functions. Numba's cache sees changes of this file; the
    digest tells it of changes in the plant's equations, which are inlined."""

    @numba.njit(cache=True, **FLAGS)
    def rates_and_forces(y, u, c, e, free_PV, free_MV, d, instant, langevin):
        out = np.empty(y.size + 2)
        if digest == "":
            return out
        q, inputs = state_at(y.reshape(-1, 1), 0, 0), inputs_at(u.reshape(-1, 1), 0, 0)
        valve, fitted = coefficients_at(c, 0, 0), effects_at(e, 0, 0)
        if instant:
            q = _with_drop(q, instant_drop(q, inputs, valve, fitted, d))
        deviating = deviating_sizes(q, inputs, valve, fitted, d)
        size = langevin_size(q, valve, deviating) if langevin else deviating.saturation
        sizes = _with_saturation(deviating, size) if langevin else deviating
        rates, force_PV, force_MV = derivative(q, inputs, valve, sizes, free_PV, free_MV, True)
        slowed = rates.vMV - d * film_rate(q, valve, fitted) * q.vMV * free_MV
        cooled = rates.coil_heat - d * q.coil_heat / IRON_TIME_CONSTANT
        current = rates.I
        if langevin:
            current = langevin_current_rate(q, valve, deviating, size, current)
        dropping = 0.0 if instant else rates.supply_drop
        store_state(out.reshape(-1, 1), 0, 0, _with_rates(rates, slowed, cooled, current, dropping))
        out[-2], out[-1] = force_PV, force_MV
        return out

    @numba.njit(cache=True, **FLAGS)
    def currents(states, u, c, e, d):
        out = np.empty(states.shape[1])
        if digest == "":
            return out
        valve, fitted = coefficients_at(c, 0, 0), effects_at(e, 0, 0)
        for k in range(out.size):
            q, inputs = state_at(states, 0, k), inputs_at(u, 0, k)
            sizes = deviating_sizes(q, inputs, valve, fitted, d)
            out[k] = coil_current(inputs.U, q.I, valve.R, q.coil_heat, sizes)
        return out

    return rates_and_forces, currents


_rates_and_forces, currents_at_terminals = _compile(source_digest())


def right_hand_side(form_deviation: float, forms: Collection[str] = ()) -> RightHandSide:
    """The plant with effects of the bench's forms, for `simulate_reference`.

    Args:
        form_deviation: share by which the forms deviate [-].
        forms: effects that have their other form.
    """
    instant, langevin = INSTANT_DROP in forms, LANGEVIN in forms

    def rates_and_forces(y, u, c, e, free_PV, free_MV):
        return _rates_and_forces(y, u, c, e, free_PV, free_MV, form_deviation, instant, langevin)

    return rates_and_forces
