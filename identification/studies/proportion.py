"""A proportion of counted cases with its exact confidence interval."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar

from scipy.stats import binomtest

Case = TypeVar("Case")


@dataclass(frozen=True, kw_only=True)
class Proportion:
    """How many of how many cases, with the exact 95 % interval (Clopper & Pearson 1934)."""

    hits: int
    """Cases that have the property [-]."""
    of: int
    """All cases [-]."""

    @classmethod
    def count(cls, cases: Iterable[Case], has_property: Callable[[Case], bool] = bool) -> "Proportion":
        """The proportion of the cases that have a property.

        Args:
            cases: of any kind; an array has shape (cases,).
            has_property: of one case; without it the cases are themselves true or false.
        """
        properties = [bool(has_property(case)) for case in cases]
        return cls(hits=sum(properties), of=len(properties))

    @property
    def value(self) -> float | None:
        """Hits over cases [-]; None without cases."""
        return self.hits / self.of if self.of else None

    @property
    def interval(self) -> tuple[float, float]:
        """Lower and upper end of the exact 95 % interval [-]; 0 and 1 without cases."""
        if not self.of:
            return 0.0, 1.0
        interval = binomtest(self.hits, self.of).proportion_ci()
        return float(interval.low), float(interval.high)

    def as_json(self) -> dict[str, Any]:
        """Value, both ends of the interval and both counts."""
        low, high = self.interval
        return {"value": self.value, "low": low, "high": high, "hits": self.hits, "of": self.of}
