"""Timing with medians, and one table of what was measured."""

import statistics
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Row:
    """One measured quantity."""

    name: str
    unit: str
    values: list[float]
    """One per repetition."""
    ratio: float | None = None
    """Against the row that the section compares with."""
    limit: float | None = None
    """Acceptance criterion: the largest accepted median, in the row's unit."""
    note: str = ""

    @property
    def median(self) -> float:
        """Median of the repetitions."""
        return statistics.median(self.values)

    @property
    def verdict(self) -> str:
        """Whether the median meets the acceptance criterion; empty without one."""
        if self.limit is None:
            return ""
        return "met" if self.median <= self.limit else "MISSED"

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready; the field `bar` is the acceptance criterion."""
        fields = asdict(self)
        fields["bar"] = fields.pop("limit")
        return {**fields, "median": self.median, "verdict": self.verdict}


@dataclass
class Table:
    """Rows under headings, in order of measurement; printed as they come."""

    sections: dict[str, list[Row]] = field(default_factory=dict)

    def section(self, title: str) -> None:
        """Begin a new part."""
        self.sections[title] = []
        print(f"\n{title}", flush=True)

    def add(self, name: str, unit: str, values: list[float] | float, **more: Any) -> Row:
        """Record and print one row. more: ratio, limit, note of the row."""
        row = Row(name=name, unit=unit, values=values if isinstance(values, list) else [values], **more)
        list(self.sections.values())[-1].append(row)
        spread = f"{min(row.values):.4g}..{max(row.values):.4g}" if len(row.values) > 1 else ""
        ratio = "" if row.ratio is None else f"x {row.ratio:.4g}"
        limit = "" if row.limit is None else f"at most {row.limit:g} {unit} {row.verdict}"
        words = "; ".join(filter(None, (limit, row.note)))
        line = f"  {name:<58} {row.median:>11.5g} {unit:<10} {spread:<22} {ratio:<11} {words}"
        print(line.rstrip(), flush=True)
        return row

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {title: [row.as_dict() for row in rows] for title, rows in self.sections.items()}


Clock = Callable[[], float]

WALL: Clock = time.perf_counter
"""Wall time [s]: longer when other processes use the cores too."""
CPU: Clock = time.process_time
"""CPU time of this process, summed over its threads [s]: comparable on a busy machine."""


def durations(function: Callable[[], object], repetitions: int, clock: Clock = CPU) -> list[float]:
    """Time of each call [s]; one more call before them is not counted."""
    function()
    seconds = []
    for _ in range(repetitions):
        start = clock()
        function()
        seconds.append(clock() - start)
    return seconds


def rates(amount: float, seconds: list[float]) -> list[float]:
    """Amount per second for each duration [s]."""
    return [amount / each for each in seconds]
