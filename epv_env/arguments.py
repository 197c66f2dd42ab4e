"""What a user may write for an environment's arguments, turned into what the task works with."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np

from epv_env.plant.consumption import Scenario, check_scenario
from epv_env.plant.effects.registry import effect
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Region
from epv_env.plant.supply import Supply
from epv_env.reward import RewardWeights
from epv_env.signals import MovingTarget, RecordedConsumption

Range = tuple[float, float]
"""Least and greatest value."""

PRESSURE_LIMITS_BAR = (1.0, 16.0)
"""Range of the pressure sensors (Table 1), bar absolute."""


class OptionError(ValueError):
    """An environment option is unknown or out of range: the message says which and the remedy."""


def check_count(name: str, value: Any) -> None:
    """Raises OptionError unless the value is a whole number of at least 1."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise OptionError(f"{name} = {value!r}: give a whole number of at least 1")


def as_range(name: str, value: Any, limits: Range = PRESSURE_LIMITS_BAR) -> Range:
    """A number or (low, high) as a range inside the limits. Raises OptionError."""
    try:
        low, high = (float(end) for end in (value if np.ndim(value) else (value, value)))
    except (TypeError, ValueError):
        raise OptionError(f"{name} is {value!r}: give a number or (low, high)") from None
    if not limits[0] <= low <= high <= limits[1]:
        raise OptionError(
            f"{name} = [{low:g}, {high:g}] must satisfy {limits[0]:g} <= low <= high <= {limits[1]:g}"
        )
    return low, high


def as_region(value: Any, plant: Plant) -> Region:
    """A region from its name, from values and ranges by symbol, from Parameters or a Region."""
    if isinstance(value, Region):
        return value
    if isinstance(value, Parameters):
        return Region(centre=value)
    if isinstance(value, Mapping):
        return Region.from_choices(value, plant.parameters)
    if value == "confidence":
        if not plant.region.varies:
            raise OptionError(
                f"plant {plant.name!r} has no confidence region: give ranges by symbol, or a plant "
                "file from identification"
            )
        return plant.region
    return Region.named(value, plant.parameters)


def as_supply(value: Any) -> Supply:
    """A Supply, from itself, a constant pressure or range [bar absolute], or None (reservoirs)."""
    if value is None:
        return Supply.reservoirs()
    if isinstance(value, Supply):
        return value
    return Supply.constant(*as_range("supply", value))


def as_target(value: Any) -> Range | MovingTarget:
    """A target from a number, (low, high), a function of the time [s], or a MovingTarget."""
    if isinstance(value, MovingTarget):
        return value
    if callable(value):
        function: Any = value
        return MovingTarget(at=function)
    return as_range("target_bar", value)


def as_scenario(value: Any) -> str | Scenario | RecordedConsumption:
    """A scenario, its name, or a recording of the consumption. Raises ValueError."""
    return value if isinstance(value, RecordedConsumption) else check_scenario(value)


def as_weights(value: Any, band_bar: float | None) -> RewardWeights:
    """Weights from themselves or from a mapping of some by name; band_bar: the band's half-width."""
    known = {entry.name for entry in fields(RewardWeights)}
    if isinstance(value, Mapping):
        if unknown := sorted(map(str, set(value) - known)):
            raise OptionError(
                f"unknown reward weight {unknown[0]!r}: known are {', '.join(sorted(known))}"
            )
        value = RewardWeights(**value)
    if not isinstance(value, RewardWeights):
        raise OptionError(f"weights is {value!r}: give a RewardWeights, or a mapping of its fields")
    return value if band_bar is None else replace(value, band_bar=band_bar)


def as_effects(value: Any) -> dict[str, Any]:
    """Sizes of effects by symbol, each a number or (low, high) [SI].

    value: by the effect's name a size, or where it has several a mapping of sizes by symbol.
    """
    if not isinstance(value, Mapping):
        raise OptionError(f"effects is {value!r}: give a mapping from an effect's name to its size")
    sizes: dict[str, Any] = {}
    for name, given in value.items():
        symbols = effect(name).symbols
        own = given if isinstance(given, Mapping) else dict.fromkeys(symbols, given)
        if (not isinstance(given, Mapping) and len(symbols) > 1) or set(own) - set(symbols):
            raise OptionError(
                f"effect {name} is sized by {', '.join(symbols)}: give a mapping from these symbols to "
                "values or (low, high)"
            )
        sizes |= own
    return sizes
