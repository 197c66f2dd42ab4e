"""Numbers in reports: with prefixed units, probabilities, and gaps with their intervals."""

import re
from collections.abc import Sequence

from epv_env.common.units import plain_powers
from identification.block_bootstrap import Interval

PREFIXES = {"M": 1e6, "k": 1e3, "": 1.0, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12}

POWER_PREFIXES = {"": 1.0, "d": 1e-1, "c": 1e-2, "m": 1e-3, "u": 1e-6}
"""Prefixes of units, and of units with a power of two or three."""

PREFIXED = (
    "A", "C", "F", "H", "Hz", "J", "K", "N", "Ohm", "Pa", "S", "T", "V", "W", "bar", "g", "m", "rad",
    "s",
)  # fmt: skip
"""Units that take a prefix."""


def quantity(value: float, unit: str) -> str:
    """A value [SI] with its unit and a prefix: 2.4 mS, 0.02 mm^2."""
    name, scale = readable_unit(unit, value)
    return f"{three_digits(value / scale)} {name}".strip()


def quantity_with_interval(value: float, low: float, high: float, unit: str) -> str:
    """A value [SI] and the ends of its interval [SI], with one unit."""
    name, scale = readable_unit(unit, value)
    numbers = [three_digits(number / scale) for number in (value, low, high)]
    return f"{numbers[0]} ({numbers[1]} to {numbers[2]}) {name}".strip()


def three_digits(number: float) -> str:
    """A number to three significant digits, without an exponent where none is needed."""
    if 1e-3 <= abs(number) < 999.5:
        return f"{number:#.3g}".rstrip(".")
    return f"{number:.0f}" if 999.5 <= abs(number) < 1e6 else f"{number:.3g}"


def readable_unit(unit: str, size: float) -> tuple[str, float]:
    """The unit with the prefix that suits numbers of a size [SI], and the size of that unit in SI.

    A unit that takes no prefix stays as it is, as does one with another power; '1' is no unit.
    """
    if unit == "1":
        return "", 1.0
    first = re.match(r"([A-Za-z]+)(?:\^([23]))?(?=$|[\s/·*.])(?!\.\d)", plain_powers(unit))
    if not first or first[1] not in PREFIXED:
        return unit, 1.0
    power = int(first[2] or 1)
    least, prefixes = (1.0, PREFIXES) if power == 1 else (1e-2, POWER_PREFIXES)
    for prefix, factor in prefixes.items():
        if abs(size) >= least * factor**power:
            return prefix + unit, factor**power
    return unit, 1.0


def listed(words: Sequence[str]) -> str:
    """Words in a sentence: a, b and c."""
    return f"{', '.join(words[:-1])} and {words[-1]}" if len(words) > 1 else "".join(words)


def probability_text(probability: float) -> str:
    """A probability in percent, bounded by < 1 % and > 99 %."""
    if probability > 0.99:
        return "> 99 %"
    return "< 1 %" if probability < 0.01 else f"{100 * probability:.0f} %"


def share_text(share: Interval) -> str:
    """A share [1] and its interval in percent."""
    return f"{100 * share.value:.0f} % ({100 * share.low:.0f} to {100 * share.high:.0f} %)"


def gap_text(value: float) -> str:
    """A gap [noise deviations], to the hundredth below ten."""
    return f"{value:.2f}" if value < 9.995 else f"{value:.1f}"


def gap_with_interval(gap: Interval) -> str:
    """A gap and its interval [noise deviations]."""
    return f"{gap_text(gap.value)} ({gap_text(gap.low)} to {gap_text(gap.high)})"
