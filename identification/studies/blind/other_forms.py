"""Other forms: effects of the bench that follow another law than the fitted one.

A deviating form (deviating_forms.py) bends the fitted law by a share of itself. Another form is another
law for the same thing, as a second simulator or a real valve may have it. Without the effect both are
the plant's; the table says where else they agree.

| Effect | Fitted form | Other form here | They agree |
|---|---|---|---|
| supply_restriction | the drop follows the flow in 2 ms | the flow's drop at once | at a steady flow |
| magnetic_saturation | Φ sMV = u/(1 + u), Fröhlich | Φ sMV = coth 3u − 1/(3u) | u near 0, u large |

Instant drop: the root of D = (z w)²/(2 ρ), flow w and density ρ as behind D; a flow back has no drop. So
do simulators that take a restriction as algebraic. Langevin's curve (1905) is the anhysteretic curve of
Jiles and Atherton 1986; the force is that of its coenergy.

u = sMV N I/Rm. Both have a fitted size: z_supply and sMV mean the same in both forms.
"""

import math

import numba

from epv_env.plant.effects.magnet import saturated_force, saturation_level
from epv_env.plant.equations import State, flow_inlet, flow_PV, reluctance_inverse
from epv_env.plant.primitives import FLAGS, inlined, replacing
from identification.studies.blind.deviating_forms import deviating_sizes

INSTANT_DROP, LANGEVIN = "supply_restriction", "magnetic_saturation"

OTHER_FORMS = (INSTANT_DROP, LANGEVIN)
"""Effects that have another form."""

HALVINGS = 40
"""Bisections for a root: the drop is then exact to 1e-6 Pa, a level of saturation to 1e-10."""

SERIES_LEVEL = 0.03
"""Level of saturation below which series replace the Langevin function, which cancels there [-]."""

LEVEL_RATIO = 2.0
"""Largest Froelich level that gives the force of a Langevin level, relative to it [-]."""

_with_drop = replacing(State, "supply_drop")
_with_supply = replacing(State, "p1")


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
    level = saturation_level(q.I + e.I_rem, reluctance_inverse(q, c), e)
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
    level = saturation_level(current, inverse_Rm, e)
    fitted = 1.0 + (size / e.saturation * level if e.saturation > 0.0 else 0.0)
    return (rate + motion) / (fitted * fitted * langevin_slope(level)) - motion
