"""Units as files write them, and what they mean: quantity, size in SI, gauge or absolute.

pint knows the units. Gauge and absolute are no units but references, which files append to the unit in
many ways ("barg", "bar (abs)", "psi gauge"); they are read here and never guessed.
"""

import re
from dataclasses import dataclass
from functools import cache
from typing import Any

from identification.importing.source_file import ImportingError, needed_package

QUANTITIES = {"time": "s", "current": "A", "voltage": "V", "pressure": "Pa", "mass flow": "kg/s"}
"""Quantities of a recording with their SI units."""

REFERENCES = {"gauge": ("gauge", "rel", "relative", "g", "ü", "r"), "absolute": ("absolute", "abs", "a")}
"""Words that say what a pressure is measured against; ü is the German Überdruck."""

SPELLINGS = {
    "Bar": "bar", "BAR": "bar", "mBar": "mbar", "MBAR": "mbar", "PSI": "psi", "Psi": "psi",
    "Volt": "V", "Ampere": "A", "Amp": "A", "amps": "A", "volts": "V", "sec": "s", "Sek": "s",
    "msec": "ms", "µsec": "us", "KPa": "kPa", "kpa": "kPa", "hpa": "hPa",
    "μs": "us", "μA": "uA", "seconds": "s", "v": "V",
}  # fmt: skip
"""Spellings that pint reads differently or not at all."""

LONGEST = 24
"""Longest text that is taken for a unit."""


@dataclass(frozen=True, kw_only=True)
class PhysicalUnit:
    """A unit that was understood."""

    text: str
    """As it was written."""
    quantity: str
    """One of QUANTITIES, or "another quantity"."""
    size: float
    """[SI]."""
    reference: str = ""
    """gauge, absolute, or empty where the text does not say."""


def parsed_unit(text: str) -> PhysicalUnit | None:
    """The meaning of a unit's text; None if it is no unit."""
    text = text.strip().strip("[]").strip()
    if not text or len(text) > LONGEST or text[0].isdigit():
        return None
    whole = _plain(text, text, "")
    if whole is not None:
        return whole
    for reference, words in REFERENCES.items():
        for word in words:
            found = re.fullmatch(rf"(.+?)[\s_.(\[-]*{word}[.)\]]*", text, re.IGNORECASE)
            unit = _plain(text, found[1], reference) if found else None
            if unit is not None and unit.quantity == "pressure":
                return unit
    return None


def needed_unit(text: str, quantity: str, where: str) -> PhysicalUnit:
    """The meaning of a unit's text. Raises ImportingError if it is none of that quantity."""
    unit = parsed_unit(text)
    if unit is None or unit.quantity != quantity:
        example = {"pressure": "mbar gauge", "time": "ms", "current": "mA", "voltage": "V"}
        kind = f"a unit of {unit.quantity}" if unit else "no unit"
        raise ImportingError(
            f"{where}: {text!r} is {kind}, and a unit of {quantity} is needed: give one such as "
            f"{example.get(quantity, 'kg/s')!r}"
        )
    return unit


def is_unit(text: str) -> bool:
    """Whether a text is a unit, or says that there is none."""
    return text in ("-", "1", "%") or parsed_unit(text) is not None


def _plain(text: str, unit: str, reference: str) -> PhysicalUnit | None:
    """A unit without words of reference; None if pint does not know it."""
    registry = _registry()
    try:
        known = registry.parse_units(SPELLINGS.get(unit, unit))
        one = registry.Quantity(1.0, known)
        size = float((2.0 * one).to_base_units().magnitude - one.to_base_units().magnitude)
    except Exception:  # pint raises many kinds of error on texts that are no units
        return None
    quantity = next(
        (q for q, si in QUANTITIES.items() if known.is_compatible_with(si)), "another quantity"
    )
    return PhysicalUnit(text=text, quantity=quantity, size=size, reference=reference)


@cache
def _registry() -> Any:
    return needed_package("pint", "Units of measurement files").UnitRegistry(cache_folder=None)
