"""SI units as text, and what FMI says of them: powers of the base units."""

from collections import Counter

BASE = {
    "kg": {"kg": 1}, "m": {"m": 1}, "s": {"s": 1}, "A": {"A": 1}, "K": {"K": 1}, "rad": {"rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "S": {"kg": -1, "m": -2, "s": 3, "A": 2},
    "1": {},
}  # fmt: skip
"""Powers of the base units by symbol."""

DISPLAY = {"Pa": ("bar", 1e-5), "m": ("mm", 1e3), "s": ("ms", 1e3)}
"""Unit in which a tool may show a quantity, and how many of it make one, by SI unit."""


class UnitError(ValueError):
    """A unit is not one of those that an FMU's description is written with."""


def base_units(unit: str) -> dict[str, int]:
    """Powers of the base units of a unit such as `V s/(A m)`. Raises UnitError for an unknown one."""
    numerator, _, denominator = unit.partition("/")
    powers: Counter[str] = Counter()
    for text, sign in ((numerator, 1), (denominator, -1)):
        for factor in text.strip("()").split():
            symbol, _, power = factor.partition("^")
            if symbol not in BASE:
                raise UnitError(f"unit {unit!r} holds {symbol!r}: add it to {__name__}.BASE")
            for base, exponent in BASE[symbol].items():
                powers[base] += sign * int(power or 1) * exponent
    return {base: exponent for base, exponent in powers.items() if exponent}
