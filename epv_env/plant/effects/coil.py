"""Effects of the winding and its power stage: heating, eddy currents, clamp, voltage drop."""

import math

from epv_env.plant.effects.record import Effect, Size
from epv_env.plant.primitives import inlined

OFF_VOLTAGE = 1.0
"""Below this voltage the power stage counts as off [V]."""

CLAMP_WIDTH = 0.01
"""Current over which a clamp's voltage rises to its value [A]: no integrator follows a jump at zero."""

NO_CURRENT = 1e-6
"""Below this the decay against a clamp is over, and the clamp conducts no more [A]."""

COPPER = 0.00393
"""Relative rise of copper's resistance per kelvin [1/K]."""

COOLING_TIME = 60.0
"""Time constant with which the winding cools [s]."""

COIL_HEATING = Effect(
    name="coil_heating",
    component="solenoid",
    strength=("heating",),
    form="dθ/dt = h R(θ) I² − θ/60 s, R(θ) = R (1 + 0.00393 θ)",
    source=(
        "copper, 0.393 %/K; h: inverse heat capacity, 50 g of copper 0.05 K/J; 60 s of cooling: assumed"
    ),
    sizes=(
        Size(
            symbol="h_coil",
            constant="heating",
            unit="K/J",
            domain=(0, 2),
            meaning="temperature rise of the winding per energy turned into heat",
            trials=(0.2,),
            drawn=(0.05, 0.5),
        ),
        Size(
            symbol="theta_coil",
            constant="coil_start",  # it sets the state, not its rates
            unit="K",
            domain=(-60, 100),
            meaning="temperature rise of the winding at the start",
            swept=(5.0, 50.0),
            either_sign=True,
            scatter=25.0,
            difference=0.1,
        ),
    ),
    alternatives={"": ("h_coil",), "start": ("theta_coil",)},
)

EDDY_CURRENT = Effect(
    name="eddy_current",
    component="solenoid",
    strength=("eddy",),
    form="the coil's terminals carry (I + G U)/(1 + G R), I makes the flux: dλ/dt = (U − R I)/(1 + G R)",
    source=(
        "one shorted secondary turn, seen from the coil; measured beside a leakage inductance: "
        "232–263 Ω, about 4 mS for a coil like this one"
    ),
    sizes=(
        Size(
            symbol="G_eddy",
            constant="eddy",
            unit="S",
            domain=(0, 0.02),
            meaning="conductance of the shorted turn in the iron, seen from the coil",
            trials=(2e-3,),
            drawn=(8e-4, 8e-3),
        ),
    ),
)

FLYBACK_VOLTAGE = Effect(
    name="flyback_voltage",
    component="solenoid",
    strength=("U_clamp",),
    form="with the stage off (U ≤ 1 V) the coil sees U − U_clamp I/√(I² + (10 mA)²)",
    source=(
        "free-wheeling diode 0.7 V, Zener or avalanche clamp 30–60 V: data sheets of low-side drivers"
    ),
    sizes=(
        Size(
            symbol="U_clamp",
            constant="U_clamp",
            unit="V",
            domain=(0, 60),
            meaning="voltage of the diode or clamp against which the current decays",
            trials=(0.7, 8.0, 40.0),
            drawn=(0.7, 45.0),
        ),
    ),
)

DRIVER_VOLTAGE_DROP = Effect(
    name="driver_voltage_drop",
    component="solenoid",
    strength=("U_drop",),
    form="the coil sees U − U_drop while on",
    source="saturation voltage of bipolar stages 1–2 V, of MOSFETs 0.1–0.5 V: data sheets",
    sizes=(
        Size(
            symbol="U_drop",
            constant="U_drop",
            unit="V",
            domain=(0, 3),
            meaning="voltage that the power stage keeps from the coil while it is on",
            trials=(0.7,),
            drawn=(0.2, 2.0),
        ),
    ),
)


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
