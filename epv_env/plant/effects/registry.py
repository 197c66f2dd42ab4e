"""The catalogue of effects, and the table of constants that the kernels read."""

from collections import namedtuple
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.effects import (
    chambers,
    coil,
    flows,
    law,
    magnet,
    measurement,
    movers,
    seats,
)
from epv_env.plant.effects.law import growth
from epv_env.plant.effects.record import Effect, EffectError
from epv_env.plant.effects.step_limits import step_limits
from epv_env.plant.primitives import generated, inlined

EFFECTS: tuple[Effect, ...] = (
    coil.COIL_HEATING,
    coil.EDDY_CURRENT,
    coil.FLYBACK_VOLTAGE,
    coil.DRIVER_VOLTAGE_DROP,
    magnet.MAGNETIC_SATURATION,
    magnet.MAGNETIC_REMANENCE,
    movers.ARMATURE_FRICTION,
    movers.ARMATURE_BOUNCE,
    movers.ARMATURE_PRESSURE_FORCE,
    seats.INLET_SEAT_LEAK,
    seats.EXHAUST_SEAT_LEAK,
    chambers.CONTROL_CHAMBER_HEAT,
    chambers.MOVING_CONTROL_VOLUME,
    flows.PRESSURE_DEPENDENT_DISCHARGE,
    flows.CRITICAL_PRESSURE_RATIO,
    movers.PISTON_FRICTION,
    flows.FLOW_FORCE,
    flows.LOCAL_GAS_SPEED,
    seats.SEAT_LEAK,
    seats.CIRCUIT_LEAK,
    chambers.OUTPUT_CHAMBER_HEAT,
    chambers.OUTPUT_PIPE,
    flows.SUPPLY_RESTRICTION,
    measurement.PRESSURE_SENSOR_LAG,
    measurement.PRESSURE_SENSOR_BIAS,
    measurement.PRESSURE_SENSOR_GAIN,
    measurement.CURRENT_SENSOR_GAIN,
    measurement.COMMAND_DELAY,
)
"""Every effect; the order is that of tables, reports and of what is drawn."""

CATALOGUE: dict[str, tuple[str, ...]] = {effect.name: effect.symbols for effect in EFFECTS}
"""Symbols that size each effect, by its name; all 0 is off."""

PLACES = {name: place for place, name in enumerate(CATALOGUE, start=1)}
"""Number by which a law names its effect."""

CONSTANTS = (
    *(row for effect in EFFECTS for row in effect.rows),
    *law.constants(EFFECTS),
    *step_limits(EFFECTS),
)
"""Rows of the kernel's table of effects."""

Effects = namedtuple("Effects", [row.name for row in CONSTANTS])
Effects.__doc__ = "Constants of the effects as the equations use them (CONSTANTS); a size of 0 is off."

LAWFUL = {name: record.name for record in EFFECTS for name in record.strength}
"""Effect of each constant that a law multiplies."""

_first_law, _second_law = (
    generated(
        f"law_{slot}",
        "e",
        f"return Terms({', '.join(f'e.law{slot}_{name}' for name in law.Terms._fields)})",
        Terms=law.Terms,
    )
    for slot in law.SLOTS
)

_scaled = generated(
    "scaled",
    "e, g1, g2",
    "return Effects(" + ", ".join(
        f"e.{name} * (1.0 + e.law1_on_{LAWFUL[name]} * g1) * (1.0 + e.law2_on_{LAWFUL[name]} * g2)"
        if name in LAWFUL else f"e.{name}"
        for name in Effects._fields
    ) + ")",
    Effects=Effects,
)  # fmt: skip


@inlined
def with_laws(q, e):
    """The constants whose strengths follow their laws at a state q; e: Effects."""
    first = _first_law(e)
    second = _second_law(e)
    return _scaled(e, growth(q, first), growth(q, second))


def effect(name: str) -> Effect:
    """The record of an effect. Raises EffectError for a name that no effect has."""
    for record in EFFECTS:
        if record.name == name:
            return record
    raise EffectError(f"unknown effect {name!r}: known are {', '.join(CATALOGUE)}")


def effect_constants(p: Mapping[str, ArrayLike]) -> NDArray:
    """Table (rows of Effects, n) for one valve (scalars) or n valves (arrays of shape (n,)) [SI]."""
    values = {symbol: np.asarray(value, dtype=float) for symbol, value in p.items()}
    rows = [row.value(values) for row in CONSTANTS]
    return np.ascontiguousarray(np.broadcast_arrays(*np.atleast_1d(*rows)), dtype=float)


def has_effects(constants: NDArray) -> NDArray:
    """Which valves have an effect switched on, boolean (n,); constants: (rows of Effects, n)."""
    sizes = [values for row, values in zip(CONSTANTS, constants, strict=True) if row.is_size]
    return np.any(np.asarray(sizes) != 0, axis=0)
