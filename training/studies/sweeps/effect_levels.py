"""Sizes at which a sweep tries each effect of the gap catalogue: small, typical, and the range's top."""

from collections.abc import Iterator

import numpy as np

from epv_env.plant.parameters import table
from identification.studies.blind.effect_draws import RANGES, Range

LEVELS = ("small", "typical", "top")

COLD_OR_HOT = Range("theta_coil", 5.0, 50.0, either_sign=True)
"""How far the winding is from ambient at the start [K]; the blind check draws only how fast it heats."""

STRONGER_WHEN_SMALLER = ("A_pipe",)
"""Sizes that go the other way; 0 would cut the consumers off: their top is the smallest ever drawn."""


def effect_levels() -> Iterator[tuple[str, str, dict[str, float]]]:
    """(effect, level, sizes by symbol [SI]) of every effect, alternative and sign, at LEVELS.

    Small is the least and typical the (geometric) middle of what the blind check draws; top is the end
    of the range in docs/effects.md, which may lie far beyond what a sound valve has.
    """
    catalogue = {**RANGES, "coil_heating": (*RANGES["coil_heating"], (COLD_OR_HOT,))}
    for effect, alternatives in catalogue.items():
        for ranges in alternatives:
            for sign in (1, -1) if ranges[0].either_sign else (1,):
                name = _name(effect, ranges, sign, several=len(alternatives) > 1)
                for level in LEVELS:
                    yield name, level, {each.symbol: _size(each, level, sign) for each in ranges}


def _name(effect: str, ranges: tuple[Range, ...], sign: int, *, several: bool) -> str:
    """The effect, with the symbol where alternatives differ in it, and the sign where it has two."""
    symbol = f" {ranges[0].symbol}" if several else ""
    ending = {1: " +", -1: " −"}[sign] if ranges[0].either_sign else ""
    return f"{effect}{symbol}{ending}"


def _size(drawn: Range, level: str, sign: int) -> float:
    """A size, with its sign [SI]."""
    if drawn.symbol in STRONGER_WHEN_SMALLER:
        return {"small": drawn.high, "typical": _middle(drawn), "top": drawn.low}[level]
    ends = table()[drawn.symbol].domain or (0.0, 0.0)
    if level == "top":
        return ends[1] if sign > 0 else ends[0]
    return sign * (drawn.low if level == "small" else _middle(drawn))


def _middle(drawn: Range) -> float:
    """Geometric middle of a range [SI]."""
    return float(np.sqrt(drawn.low * drawn.high))
