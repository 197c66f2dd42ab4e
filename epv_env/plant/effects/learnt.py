"""A learnt term: a function of one state, fitted to recordings, on one equation. It names no cause.

The function is linear between nine knots, and falls to 0 over one more interval beyond either end.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import GRAM
from epv_env.plant.effects.record import Constant, Size
from epv_env.plant.primitives import Value, inlined

KNOTS = 9
"""Knots: what a smooth term of physics needs, since it bends once or twice."""

EQUATIONS = {"f1": ("g/s", GRAM), "f2": ("g/s", GRAM), "f4": ("N", 1.0), "f6": ("N", 1.0),
             "f7": ("V", 1.0)}  # fmt: skip
"""Unit of a table, and its size in SI, by equation: balances of air in the output and in the control
chamber, forces on piston and armature, voltage of the coil."""

STATES = {
    "p1 - p2": ("Pa", {"p1": 1.0, "p2": -1.0}),
    "p1 - p3": ("Pa", {"p1": 1.0, "p3": -1.0}),
    "p2": ("Pa", {"p2": 1.0}),
    "p3": ("Pa", {"p3": 1.0}),
    "xPV": ("m", {"xPV": 1.0}),
    "vPV": ("m/s", {"vPV": 1.0}),
    "xMV": ("m", {"xMV": 1.0}),
    "vMV": ("m/s", {"vMV": 1.0}),
    "I": ("A", {"I": 1.0}),
    "U": ("V", {"U": 1.0}),
}
"""Unit of a state that a term may be a function of, and its weights in what the equations know."""

KNOT_SYMBOLS = tuple(f"learnt_{k}" for k in range(1, KNOTS + 1))
SYMBOLS = ("learnt_equation", "learnt_state", "learnt_low", "learnt_high", *KNOT_SYMBOLS)
"""Rows of the parameter table; all 0 is off."""

SIZES = (
    Size(
        symbol="learnt_equation", unit="1", domain=(0, 7), meaning="number of the equation; 0: none"
    ),
    Size(
        symbol="learnt_state", unit="1", domain=(0, len(STATES)),
        meaning=f"place of the state among {', '.join(STATES)}; 0: none",
    ),
    Size(symbol="learnt_low", unit="1", domain=(-2e6, 2e6), meaning="state [SI] at the first knot"),
    Size(symbol="learnt_high", unit="1", domain=(-2e6, 2e6), meaning="state [SI] at the last knot"),
    *(
        Size(symbol=symbol, unit="1", domain=(-100, 100), meaning=f"term at knot {k} in g/s, N or V")
        for k, symbol in enumerate(KNOT_SYMBOLS, start=1)
    ),
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class LearntTerm:
    """Field `learnt_term` of a plant file (docs/reference/files.md)."""

    equation: str
    """One of EQUATIONS."""
    unit: str
    """Of values and sd."""
    state: str
    """One of STATES."""
    state_unit: str
    low: float
    """State at the first knot [state_unit]."""
    high: float
    """State at the last knot; the knots are equally far apart [state_unit]."""
    values: tuple[float, ...]
    """At the knots [unit]."""
    sd: tuple[float, ...]
    """Their standard deviations [unit]."""
    share_closed: tuple[float, float, float]
    """Share of the explainable gap on recordings never fitted to that the plant closes more with the
    term than without, and the ends of its interval [1]."""

    def __post_init__(self) -> None:
        known = self.equation in EQUATIONS and self.state in STATES
        if not known or (self.unit, self.state_unit) != self.units(self.equation, self.state):
            raise ValueError("learnt_term has another equation, state or unit than there are")
        if not self.low < self.high or not len(self.values) == len(self.sd) == KNOTS:
            raise ValueError(f"learnt_term needs low < high, {KNOTS} values and {KNOTS} sd")

    @staticmethod
    def units(equation: str, state: str) -> tuple[str, str]:
        """Units of the values and of the state."""
        return EQUATIONS[equation][0], STATES[state][0]

    @property
    def parameters(self) -> dict[str, float]:
        """The term as parameters by symbol."""
        knots = dict(zip(KNOT_SYMBOLS, self.values, strict=True))
        return placed(self.equation, self.state, self.low, self.high) | knots


def placed(equation: str, state: str, low: float, high: float) -> dict[str, float]:
    """Where a term acts, as parameters by symbol; its knots are 0 yet. low, high: [unit of STATES]."""
    where = (float(equation[1:]), 1.0 + list(STATES).index(state), low, high)
    return dict(zip(SYMBOLS, (*where, *[0.0] * KNOTS), strict=True))


def _constant(name: str, meaning: str, value: Callable[..., Value], acts: bool = False) -> Constant:
    return Constant(name=f"learnt_{name}", meaning=meaning, value=value, is_size=acts)


def _per_interval(p: Mapping[str, NDArray]) -> NDArray:
    """Knots per unit of the state; 0 without a term."""
    width = (p["learnt_high"] - p["learnt_low"]) / (KNOTS - 1)
    return np.where(width > 0.0, 1.0 / np.maximum(width, 1e-9), 0.0)


def _weight(part: str) -> Callable[[Mapping[str, NDArray]], Value]:
    """How a part of the state counts, in knots per unit."""

    def value(p: Mapping[str, NDArray]) -> Value:
        weights = [own.get(part, 0.0) for _, own in STATES.values()]
        codes = enumerate(weights, start=1)
        total = sum(np.where(p["learnt_state"] == code, w, 0.0) for code, w in codes if w)
        return total * _per_interval(p)

    return value


def _share(equation: str, scale: float) -> Callable[[Mapping[str, NDArray]], Value]:
    """1 table unit [SI] where the term acts in the equation, else 0."""
    code = float(equation[1:])
    return lambda p: np.where(p["learnt_equation"] == code, scale, 0.0)


PARTS = ("p1", "p2", "p3", "xPV", "vPV", "xMV", "vMV", "I", "U")

CONSTANTS = (
    *(_constant(f"by_{x}", f"knots per unit of {x} [1/SI]", _weight(x)) for x in PARTS),
    _constant(
        "first", "state at the first knot [intervals]", lambda p: p["learnt_low"] * _per_interval(p)
    ),
    *(
        _constant(str(k), "value at a knot [g/s, N, V]", itemgetter(symbol))
        for k, symbol in enumerate(KNOT_SYMBOLS, start=1)
    ),
    *(
        _constant(equation, f"1 table unit in {equation} [SI]", _share(equation, scale), True)
        for equation, (_, scale) in EQUATIONS.items()
    ),
)
"""Rows of the kernel's table of effects."""


@inlined
def hat(s):
    """1 at 0, 0 from 1 on."""
    return max(1.0 - abs(s), 0.0)


@inlined
def learnt_value(q, U, e):
    """The term at a state [unit of its table]; e: Effects."""
    s = e.learnt_by_p1 * q.p1 + e.learnt_by_p2 * q.p2 + e.learnt_by_p3 * q.p3
    s += e.learnt_by_xPV * q.xPV + e.learnt_by_vPV * q.vPV
    s += e.learnt_by_xMV * q.xMV + e.learnt_by_vMV * q.vMV
    s += e.learnt_by_I * q.I + e.learnt_by_U * U - e.learnt_first
    value = e.learnt_1 * hat(s) + e.learnt_2 * hat(s - 1.0) + e.learnt_3 * hat(s - 2.0)
    value += e.learnt_4 * hat(s - 3.0) + e.learnt_5 * hat(s - 4.0) + e.learnt_6 * hat(s - 5.0)
    return value + e.learnt_7 * hat(s - 6.0) + e.learnt_8 * hat(s - 7.0) + e.learnt_9 * hat(s - 8.0)
