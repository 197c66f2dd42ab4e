"""Sizes at which a sweep tries each effect of the gap catalogue: small, typical, and the range's top."""

from collections.abc import Iterator

from epv_env.plant.effects.record import Size
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.parameters import table

LEVELS = ("small", "typical", "top")


def effect_levels() -> Iterator[tuple[str, str, dict[str, float]]]:
    """(effect, level, sizes by symbol [SI]) of every effect, variant and sign, at LEVELS.

    Small is the least and typical the (geometric) middle of what sealed trials draw; top is the end of
    the physical range, which may lie far beyond what a sound valve has.
    """
    for effect in EFFECTS:
        for sizes in effect.variants.values():
            for sign in (1, -1) if sizes[0].either_sign else (1,):
                name = _name(effect.name, sizes, sign, several=len(effect.variants) > 1)
                for level in LEVELS:
                    yield name, level, {size.symbol: _size(size, level, sign) for size in sizes}


def _name(effect: str, sizes: tuple[Size, ...], sign: int, *, several: bool) -> str:
    """The effect, with the symbol where variants differ in it, and the sign where it has two."""
    symbol = f" {sizes[0].symbol}" if several else ""
    ending = {1: " +", -1: " −"}[sign] if sizes[0].either_sign else ""
    return f"{effect}{symbol}{ending}"


def _size(size: Size, level: str, sign: int) -> float:
    """A size, with its sign [SI]."""
    low, high = size.drawn or size.swept or (0.0, 0.0)
    if size.stronger_when_smaller:
        return {"small": high, "typical": size.typical, "top": low}[level]
    least, greatest = table()[size.symbol].domain or (0.0, 0.0)
    if level == "top":
        return greatest if sign > 0 else least
    return sign * (low if level == "small" else size.typical)
