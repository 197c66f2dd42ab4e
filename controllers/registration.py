"""What a controller's file says about its controller: how it is built and tuned.

The record stands beside the class, in the controller's own file. controllers/registry.py lists it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from controllers.base import Controller
from epv_env.plant.plantfile import Plant


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

    def __str__(self) -> str:
        return f"a number from {self.low:g} to {self.high:g}"

    def holds(self, value: float) -> bool:
        """Whether a value lies within."""
        return self.low <= value <= self.high


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
            RegistrationError: a quantity is missing, unknown or outside its range.
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
                    f"controller {self.kind!r}: {name} = {values[name]} is not allowed: give "
                    f"{quantity}, or tune anew with `epv tune --only {self.kind!r}`"
                )
        return self.build(values, plant)
