"""Numbers as people read them: with prefixed units, probabilities and gaps with their intervals."""

import re

from identification.gap.reduce.block_bootstrap import Interval

PREFIXES = {"M": 1e6, "k": 1e3, "": 1.0, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12}
POWER_PREFIXES = {"": 1.0, "d": 1e-1, "c": 1e-2, "m": 1e-3, "u": 1e-6}
"""Prefixes of units, and of units that are squared or cubed."""

PREFIXED = frozenset(
    ("A", "C", "F", "H", "Hz", "J", "K", "N", "Ohm", "Pa", "S", "T", "V", "W", "g", "m", "rad", "s")
)
"""Units that take a prefix."""


def quantity(value: float, unit: str) -> str:
    """A value [SI] with its unit and a prefix: 2.4 mS, 0.02 mm^2."""
    name, scale = readable(unit, value)
    return f"{short(value / scale)} {name}".strip()


def interval(value: float, low: float, high: float, unit: str) -> str:
    """A value [SI] between the ends of its interval, with its unit."""
    name, scale = readable(unit, value)
    numbers = [short(number / scale) for number in (value, low, high)]
    return f"{numbers[0]} ({numbers[1]} to {numbers[2]}) {name}".strip()


def short(number: float) -> str:
    """A number to three digits, without an exponent where it can do without."""
    if 1e-3 <= abs(number) < 999.5:
        return f"{number:#.3g}".rstrip(".")
    return f"{number:.0f}" if 999.5 <= abs(number) < 1e6 else f"{number:.3g}"


def readable(unit: str, size: float) -> tuple[str, float]:
    """The unit with a prefix in which numbers of a size [SI] are short, and its size in SI.

    A unit that takes no prefix stays as it is; '1' is no unit.
    """
    if unit == "1":
        return "", 1.0
    first = re.match(r"([A-Za-z]+)(?:\^([23]))?", unit)
    if not first or first[1] not in PREFIXED:
        return unit, 1.0
    power = int(first[2] or 1)
    least, prefixes = (1.0, PREFIXES) if power == 1 else (1e-2, POWER_PREFIXES)
    for prefix, factor in prefixes.items():
        if abs(size) >= least * factor**power:
            return prefix + unit, factor**power
    return unit, 1.0


def chance(probability: float) -> str:
    """A probability in percent that is never quite 0 or 100."""
    if probability > 0.99:
        return "> 99 %"
    return "< 1 %" if probability < 0.01 else f"{100 * probability:.0f} %"


def share(found: Interval) -> str:
    """A share and its interval in percent."""
    return f"{100 * found.value:.0f} % ({100 * found.low:.0f} to {100 * found.high:.0f} %)"


def gap(value: float) -> str:
    """A gap in noise deviations: small ones to the hundredth."""
    return f"{value:.2f}" if value < 9.995 else f"{value:.1f}"


def spread(found: Interval) -> str:
    """A gap and its interval."""
    return f"{gap(found.value)} ({gap(found.low)} to {gap(found.high)})"
