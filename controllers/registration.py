"""What a controller's file says about its controller: how it is built and tuned.

The record stands beside the class, in the controller's own file. controllers/registry.py lists it.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from controllers.base import Controller
from epv_env.plant.plantfile import Plant

NEAR_BOUND = 0.02
"""Share of a range next to its ends where a search's outcome counts as cut off by the bound [1]."""


class RegistrationError(ValueError):
    """A controller is unknown, or its record and its data do not fit: the message says what to do."""


@dataclass(frozen=True, kw_only=True)
class Range:
    """A real quantity of a search space."""

    low: float
    """Lower end, in the unit of the quantity."""
    high: float
    """Upper end, in the unit of the quantity."""
    log: bool = False
    """Whether the search draws it uniformly in its logarithm."""
    least: float | None = None
    """Physical limit down to which a search may be widened; None: `low` is the limit."""
    most: float | None = None
    """Physical limit up to which a search may be widened; None: `high` is the limit."""

    @property
    def limits(self) -> tuple[float, float]:
        """Least and greatest value that has a meaning."""
        least = self.low if self.least is None else self.least
        return least, self.high if self.most is None else self.most

    def __str__(self) -> str:
        return "a number from {:g} to {:g}".format(*self.limits)

    def holds(self, value: float) -> bool:
        """Whether a value lies within the limits."""
        return self.limits[0] <= value <= self.limits[1]

    def widened(self, value: float) -> "Range":
        """The range for another search, if one ended at `value`; itself if that is not at a bound.

        A bound with less than NEAR_BOUND of the range between it and the value moves outwards by the
        range's own length (in the logarithm if `log`), at most to the physical limit.
        """
        to, back = (math.log, math.exp) if self.log else (float, float)
        low, high, at = to(self.low), to(self.high), to(value)
        length, (least, most) = high - low, self.limits
        if at - low < NEAR_BOUND * length:
            return replace(self, low=max(back(low - length), least))
        if high - at < NEAR_BOUND * length:
            return replace(self, high=min(back(high + length), most))
        return self


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A quantity of a search space that takes one of a few values."""

    values: tuple[Any, ...]

    def __str__(self) -> str:
        return f"one of {', '.join(map(str, self.values))}"

    def holds(self, value: Any) -> bool:
        """Whether a value is one of them."""
        return value in self.values


SearchSpace = Mapping[str, Range | Choice]
"""The tuned quantities by name, in the order in which the search draws them."""


@dataclass(frozen=True, kw_only=True)
class Registration:
    """A controller's record."""

    kind: str
    """Name in tables, in controllers/tuned.json and on command lines."""
    controller: type
    """The class."""
    build: Callable[[Mapping[str, Any], Plant], Controller]
    """Makes the controller from its tuned quantities, designed for a plant. Raises ValueError if the
    quantities contradict each other."""
    search_space: SearchSpace | None
    """The quantities that tuning searches; None: nothing is tuned."""
    tuned_on: str = "sensitive_ten_percent"
    """Region of the plants that it is tuned on (epv_env.plant.region); default: the learned policy's."""

    def built(self, values: Mapping[str, Any], plant: Plant) -> Controller:
        """The controller, from exactly the quantities of its search space.

        Args:
            values: tuned quantities by name.
            plant: that it is designed for: parameters and voltage of the coil.

        Raises:
            RegistrationError: a quantity is missing, unknown or beyond its limits.
            ValueError: the quantities contradict each other.
        """
        expected = set(self.search_space or {})
        differences = {"lacks": expected - set(values), "has unknown": set(values) - expected}
        for problem, names in differences.items():
            if names:
                raise RegistrationError(
                    f"controller {self.kind!r} {problem} {', '.join(sorted(names))}: its search space "
                    "and its tuned values must name the same quantities; tune anew with "
                    f"`epv tune --only {self.kind!r}`"
                )
        for name, quantity in (self.search_space or {}).items():
            if not quantity.holds(values[name]):
                raise RegistrationError(
                    f"controller {self.kind!r}: {name} = {values[name]} has no meaning: give "
                    f"{quantity}, or tune anew with `epv tune --only {self.kind!r}`"
                )
        return self.build(values, plant)
