"""Laws: the strength of an effect as a function of a state of the valve, in place of a constant.

The catalogue assumes a law for each mechanism: friction that does not depend on the pressure, a leak
that flows like a nozzle. In a real valve the mechanism may follow another law. Then the strength of the
effect, one of the constants that its equations read, becomes strength x (1 + g(a)): a is an argument,
such as p3, and g is linear between nine knots and constant beyond them. Four laws may act at once, each
on any effect; the factors of those on one effect multiply.
"""

from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.common.law_form import KNOTS, MOST_LAWS
from epv_env.plant.effects.record import Constant, Effect, Size
from epv_env.plant.primitives import Value, generated, inlined

SLOTS = tuple(range(1, 1 + MOST_LAWS))
"""Numbers of the laws that may act at once."""

MOST_GROWTH = 3.0
"""Largest g at a knot [1]: a strength of four times the effect's own."""

ARGUMENTS = {
    "p1 - p2": ("Pa", {"p1": 1.0, "p2": -1.0}),
    "p1 - p3": ("Pa", {"p1": 1.0, "p3": -1.0}),
    "p2": ("Pa", {"p2": 1.0}),
    "p3": ("Pa", {"p3": 1.0}),
    "xPV": ("m", {"xPV": 1.0}),
    "|vPV|": ("m/s", {"vPV": 1.0}),
    "xMV": ("m", {"xMV": 1.0}),
    "|vMV|": ("m/s", {"vMV": 1.0}),
    "I": ("A", {"I": 1.0}),
    "coil_heat": ("K", {"coil_heat": 1.0}),
    "heat_3": ("1", {"heat_3": 1.0}),
    "heat_2": ("1", {"heat_2": 1.0}),
    "supply_drop": ("Pa", {"supply_drop": 1.0}),
    "|far_pressure|": ("Pa", {"far_pressure": 1.0}),
    "|lag_2|": ("Pa", {"lag_2": 1.0}),
    "|lag_3|": ("Pa", {"lag_3": 1.0}),
}
"""Unit of an argument, and its weights in the state; between bars stands a magnitude. The last seven are
states of effects: so a strength may follow the size of what the effect does."""


def knot_symbols(slot: int) -> tuple[str, ...]:
    """Symbols of a law's values at its knots."""
    return tuple(f"law{slot}_{k}" for k in range(1, KNOTS + 1))


def place_symbols(slot: int) -> tuple[str, ...]:
    """Symbols that say on which effect a law acts, over which argument, and between which ends."""
    return tuple(f"law{slot}_{name}" for name in ("effect", "argument", "low", "high"))


SYMBOLS = tuple(s for slot in SLOTS for s in (*place_symbols(slot), *knot_symbols(slot)))
"""Rows of the parameter table; all 0 is off."""


def sizes(effects: tuple[Effect, ...]) -> tuple[Size, ...]:
    """The rows as the parameter table has them. effects: the catalogue."""
    rows = []
    for slot in SLOTS:
        effect, argument, low, high = place_symbols(slot)
        rows += [
            Size(symbol=effect, unit="1", domain=(0, len(effects)), meaning="place of a law's effect"),
            Size(symbol=argument, unit="1", domain=(0, len(ARGUMENTS)), meaning="place of its argument"),
            Size(symbol=low, unit="1", domain=(-2e6, 2e6), meaning="argument [SI] at the first knot"),
            Size(symbol=high, unit="1", domain=(-2e6, 2e6), meaning="argument [SI] at the last knot"),
            *(
                Size(
                    symbol=symbol,
                    unit="1",
                    domain=(-MOST_GROWTH, MOST_GROWTH),
                    meaning=f"relative growth of the effect at knot {k}",
                )
                for k, symbol in enumerate(knot_symbols(slot), start=1)
            ),
        ]
    return tuple(rows)


@dataclass(frozen=True, kw_only=True)
class Law:
    """An entry of field `laws` of a plant file (docs/reference/files.md)."""

    effect: str
    """Name in the catalogue."""
    argument: str
    """One of ARGUMENTS."""
    unit: str
    """Of the argument."""
    low: float
    """Argument at the first knot [unit]."""
    high: float
    """Argument at the last knot; the knots are equally far apart [unit]."""
    growth: tuple[float, ...]
    """g at the knots [1]: the strength of the effect is multiplied by 1 + g."""

    def __post_init__(self) -> None:
        if self.argument not in ARGUMENTS or self.unit != ARGUMENTS[self.argument][0]:
            raise ValueError(
                f"law of {self.effect}: argument {self.argument!r} in {self.unit!r} is unknown: "
                "choose one of "
                + ", ".join(f"{name} in {unit}" for name, (unit, _) in ARGUMENTS.items())
            )
        if not self.low < self.high or len(self.growth) != KNOTS:
            raise ValueError(f"law of {self.effect}: give low < high and {KNOTS} numbers as growth")


def placed(
    slot: int, place: int, argument: str, low: float, high: float, growth: tuple[float, ...] = ()
) -> dict[str, float]:
    """A law as parameters by symbol. place: of its effect in the catalogue, from 1 on."""
    where = (float(place), 1.0 + list(ARGUMENTS).index(argument), low, high)
    knots = dict(zip(knot_symbols(slot), growth or (0.0,) * KNOTS, strict=True))
    return dict(zip(place_symbols(slot), where, strict=True)) | knots


def laws_of(p: Mapping[str, float], names: tuple[str, ...]) -> tuple[Law, ...]:
    """The laws that parameters by symbol hold. names: of all effects, in the catalogue's order."""
    laws = []
    for slot in SLOTS:
        effect, argument, low, high = (p[symbol] for symbol in place_symbols(slot))
        if effect and argument:
            name = list(ARGUMENTS)[round(argument) - 1]
            growth = tuple(p[symbol] for symbol in knot_symbols(slot))
            laws.append(
                Law(effect=names[round(effect) - 1], argument=name, unit=ARGUMENTS[name][0], low=low,
                    high=high, growth=growth)
            )  # fmt: skip
    return tuple(laws)


def arguments_of(q: Any) -> dict[str, NDArray]:
    """Every argument by name, of any shape [SI]; q: states as arrays of this shape."""
    arguments = {}
    for name, (_, weights) in ARGUMENTS.items():
        value = sum(weight * np.asarray(getattr(q, part)) for part, weight in weights.items())
        arguments[name] = np.abs(value) if name.startswith("|") else np.asarray(value)
    return arguments


Terms = namedtuple(
    "Terms", ["argument", "per_interval", "first", *(f"bend_{knot}" for knot in range(KNOTS))]
)
"""A law as the equations use it, each a row of the kernel's table: argument, its place in ARGUMENTS from
1 on; per_interval, knots per unit of it [1/SI]; first, the argument at the first knot [intervals];
bend_0, g there [1], and the changes of its slope at the knots [1/interval]."""


def _per_interval(slot: int, p: Mapping[str, NDArray]) -> NDArray:
    """Knots per unit of the argument; 0 without a law."""
    width = (p[f"law{slot}_high"] - p[f"law{slot}_low"]) / (KNOTS - 1)
    return np.where(width > 0.0, 1.0 / np.maximum(width, 1e-9), 0.0)


def _first(slot: int, p: Mapping[str, NDArray]) -> NDArray:
    """Argument at the first knot."""
    return p[f"law{slot}_low"] * _per_interval(slot, p)


def _bend(slot: int, knot: int, p: Mapping[str, NDArray]) -> Value:
    """Change of the slope of g at a knot; the value itself at the first one."""
    g = [p[symbol] for symbol in knot_symbols(slot)]
    if knot == 0:
        return g[0] + 0.0
    slope = g[knot] - g[knot - 1]
    return slope - (g[knot - 1] - g[knot - 2]) if knot > 1 else slope


def constants() -> tuple[Constant, ...]:
    """Rows of the kernel's table: of each law the place of its effect, and those of Terms."""
    values: dict[str, Callable[[Mapping[str, NDArray]], Value]] = {}
    for slot in SLOTS:
        values |= {s: itemgetter(s) for s in place_symbols(slot)[:2]}
        values[f"law{slot}_per_interval"] = partial(_per_interval, slot)
        values[f"law{slot}_first"] = partial(_first, slot)
        values |= {f"law{slot}_bend_{k}": partial(_bend, slot, k) for k in range(KNOTS)}
    return tuple(Constant(name, value, is_size=False) for name, value in values.items())


def most_growth(p: Mapping[str, NDArray], place: int) -> NDArray:
    """Largest factor by which laws may raise the strength of the effect with this place [1], shape as
    the parameters."""
    factor = np.full_like(p["law1_1"], 1.0)
    for slot in SLOTS:
        largest = p[knot_symbols(slot)[0]]
        for symbol in knot_symbols(slot)[1:]:
            largest = np.maximum(largest, p[symbol])
        acts = p[place_symbols(slot)[0]] == float(place)
        factor = factor * np.where(acts, 1.0 + np.maximum(largest, 0.0), 1.0)
    return factor


@inlined
def bent(s, bend):
    """What a bend adds behind its knot."""
    return max(s, 0.0) * bend


def _written(name: str, weights: Mapping[str, float]) -> str:
    """An argument of a state q as the equations have it."""
    text = " + ".join(f"{weight!r} * q.{part}" for part, weight in weights.items())
    return f"abs({text})" if name.startswith("|") else f"({text})"


argument_at = generated(
    "argument_at",
    "q, place",
    "return " + " + ".join(
        f"(place == {float(place)!r}) * {_written(name, weights)}"
        for place, (name, (_, weights)) in enumerate(ARGUMENTS.items(), start=1)
    ),
)  # fmt: skip
"""The argument with a place in ARGUMENTS, from 1 on, at a state q [SI]; 0 for place 0."""


@inlined
def growth(q, law):
    """g at a state, at least -1 [1]; law: Terms."""
    s = min(max(law.per_interval * argument_at(q, law.argument) - law.first, 0.0), 8.0)
    near = bent(s, law.bend_1) + bent(s - 1.0, law.bend_2) + bent(s - 2.0, law.bend_3)
    near += bent(s - 3.0, law.bend_4)
    far = bent(s - 4.0, law.bend_5) + bent(s - 5.0, law.bend_6) + bent(s - 6.0, law.bend_7)
    far += bent(s - 7.0, law.bend_8)
    return max(law.bend_0 + near + far, -1.0)
