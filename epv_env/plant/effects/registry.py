"""The catalogue of effects, and the table of constants that the kernels read."""

from collections import namedtuple
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numba.extending import overload
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
from epv_env.plant.effects.record import Effect, EffectError
from epv_env.plant.effects.step_limits import step_limits
from epv_env.plant.primitives import INLINED, generated, inlined

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
    *law.constants(),
    *step_limits(EFFECTS),
)
"""Rows of the kernel's table of effects."""

Effects = namedtuple("Effects", [row.name for row in CONSTANTS])
Effects.__doc__ = "Constants of the effects as the equations use them (CONSTANTS); a size of 0 is off."

LAWFUL = {name: record.name for record in EFFECTS for name in record.strength}
"""Effect of each constant that a law multiplies."""

Factors = namedtuple("Factors", dict.fromkeys(LAWFUL.values()))
Factors.__doc__ = "What laws multiply the strengths of each effect by [1]."


def _strengthened(
    slots: tuple[int, ...], decorator: Callable[..., Any] = inlined
) -> Callable[..., Effects]:
    """`with_laws` of the laws with these numbers."""
    growths = [f"g{slot}" for slot in slots]
    acting = "(1.0 + (e.law{0}_effect == {1}.0) * g{0})"
    factors = [
        " * ".join(acting.format(slot, PLACES[name]) for slot in slots) for name in Factors._fields
    ]
    strengths = [
        f"e.{name} * by_effect.{LAWFUL[name]}" if name in LAWFUL else f"e.{name}"
        for name in Effects._fields
    ]
    terms = [", ".join(f"e.law{slot}_{name}" for name in law.Terms._fields) for slot in slots]
    lines = [
        *(f"law_{slot} = Terms({each})" for slot, each in zip(slots, terms, strict=True)),
        f"by_effect = factors(e, {', '.join(f'growth(q, law_{slot})' for slot in slots)})",
        "return scaled(e, by_effect)",
    ]
    factors_of = generated(
        "factors", ", ".join(["e", *growths]), f"return Factors({', '.join(factors)})", Factors=Factors
    )
    scaled = generated(
        "scaled", "e, by_effect", f"return Effects({', '.join(strengths)})", Effects=Effects
    )
    return generated(
        "with_laws", "q, e, extended", "\n    ".join(lines), decorator,
        Terms=law.Terms, growth=law.growth, factors=factors_of, scaled=scaled,
    )  # fmt: skip


FEW_LAWS = law.SLOTS[:2]
"""Numbers of the laws for which the usual kernel has room: more of them slow it down."""


def _by_slots(every: Callable[..., Effects]) -> Callable[..., Effects]:
    """In compiled code, `with_laws` of few laws where the type of `extended` says so."""
    few = _strengthened(FEW_LAWS)

    @overload(every, jit_options=INLINED, strict=False)
    def chosen(q, e, extended):
        return few if getattr(extended, "count", 0) == len(FEW_LAWS) else every

    return every


with_laws = _strengthened(law.SLOTS, _by_slots)
"""The constants whose strengths follow their laws at a state q; e: Effects. extended: FEW_LAWS where no
others are in use, else True."""


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


def kernel_of(constants: NDArray) -> NDArray:
    """Which kernel of `integrate.KERNELS` each valve needs, (n,); constants: (rows of Effects, n).

    0: no effect is switched on. 1: effects with FEW_LAWS at most. 2: effects with more laws.
    """
    rows = dict(zip(CONSTANTS, constants, strict=True))
    has_effects = np.any([values != 0 for row, values in rows.items() if row.is_size], axis=0)
    further = [f"law{slot}_effect" for slot in law.SLOTS if slot not in FEW_LAWS]
    many_laws = np.any([values != 0 for row, values in rows.items() if row.name in further], axis=0)
    return np.where(has_effects, 1 + many_laws, 0)
