"""Units as files write them, and what they mean: quantity, size in SI, gauge or absolute.

pint knows the units. Gauge and absolute are no units but references, which files append to the unit in
many ways ("barg", "bar (abs)", "psi gauge"); they are read here and never guessed.
"""

import re
from functools import cache
from typing import Any, NamedTuple

from epv_env.common.units import plain_powers
from identification.importing.source_file import ImportingError, needed_package

QUANTITIES = {"time": "s", "current": "A", "voltage": "V", "pressure": "Pa"}
"""Quantities of a recording with their SI units."""

EXAMPLES = {**QUANTITIES, "pressure": "bar absolute"}
"""Units that messages give as examples."""

REFERENCES = {
    "gauge": "gauge", "gage": "gauge", "relative": "gauge", "relativ": "gauge", "rel": "gauge",
    "überdruck": "gauge", "ü": "gauge", "g": "gauge",
    "absolute": "absolute", "absolut": "absolute", "abs": "absolute", "a": "absolute",
}  # fmt: skip
"""Words after a unit of pressure that say what it is measured against, in any case."""

REFERENCED = re.compile(rf"(.+?)[\s_.,(\[{{-]*({'|'.join(REFERENCES)})[.)\]}}]*", re.IGNORECASE)
"""A unit of pressure with such a word: barg, bar (g), psi gauge, mbar abs."""

SPELLINGS = {
    "BAR": "bar", "mBar": "mbar", "MBAR": "mbar", "PSI": "psi", "KPa": "kPa", "kpa": "kPa", "KPA": "kPa",
    "pa": "Pa", "PA": "Pa", "hpa": "hPa", "μs": "us", "μA": "uA", "Sek": "s", "Sekunden": "s",
    "v": "V", "mv": "mV", "amps": "A", "Amps": "A", "Mpa": "MPa", "MPA": "MPa",
    "kg/cm^2": "kgf/cm^2", "kp/cm^2": "kgf/cm^2",
}  # fmt: skip
"""Spellings that pint reads differently or not at all; for one such as Volts it looks in lower case."""

DIRECT = re.compile(r"(V|A|Volts?|Amps?)[\s_]?DC", re.IGNORECASE)
"""A unit of voltage or current of which a data logger says that it is direct."""

LONGEST = 24
"""Longest text that is taken for a unit."""

ENDLESS = re.compile(r"\d[\d.e]|[\d)²³]\s*(\^|\*\*)|(\^|\*\*)\s*\(")
"""Numbers and powers of powers that no unit needs and that pint may compute for hours."""


class PhysicalUnit(NamedTuple):
    """A unit that was understood; its quantity is one of QUANTITIES, or "another quantity"."""

    text: str
    quantity: str
    size: float
    """[SI]."""
    reference: str
    """gauge, absolute, or empty where the text does not say."""


@cache
def parsed_unit(text: str) -> PhysicalUnit | None:
    """The meaning of a unit's text; None if it is no unit."""
    unit = re.sub(r"^[\[({](.*)[\])}]$", r"\1", text.strip()).strip()
    if not unit or len(unit) > LONGEST or unit[0].isdigit() or ENDLESS.search(unit):
        return None
    whole = _plain(text, unit, "")
    found = REFERENCED.fullmatch(unit)
    if found and (whole is None or whole.quantity not in QUANTITIES):
        pressure = _plain(text, found[1], REFERENCES[found[2].lower()])
        if pressure is not None and pressure.quantity == "pressure":
            return pressure
    return whole


def needed_unit(text: str, quantity: str, where: str) -> PhysicalUnit:
    """The meaning of a unit's text. Raises ImportingError if it is none of that quantity."""
    unit = parsed_unit(text)
    if unit is None or unit.quantity != quantity:
        kind = f"a unit of {unit.quantity}" if unit else "no unit"
        raise ImportingError(
            f"{where}: {text!r} is {kind}, and a unit of {quantity} is needed: give one such as "
            f"{EXAMPLES[quantity]!r}"
        )
    return unit


def is_unit(text: str) -> bool:
    """Whether a text is a unit, or says that there is none."""
    return text.strip("[]()") in ("-", "1", "%") or parsed_unit(text) is not None


def _plain(text: str, unit: str, reference: str) -> PhysicalUnit | None:
    """A unit without words of reference; None if pint does not know it."""
    registry = _registry()
    unit = DIRECT.sub(r"\1", plain_powers(unit))
    unit = SPELLINGS.get(unit, unit)
    try:
        known = registry.parse_units(unit.lower() if unit.istitle() and unit not in registry else unit)
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
