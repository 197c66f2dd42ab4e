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
    bar: float | None = None
    """The most that the median may be."""
    note: str = ""

    @property
    def median(self) -> float:
        """Median of the repetitions."""
        return statistics.median(self.values)

    @property
    def verdict(self) -> str:
        """What the bar says of it; empty without a bar."""
        if self.bar is None:
            return ""
        return "met" if self.median <= self.bar else "MISSED"

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {**asdict(self), "median": self.median, "verdict": self.verdict}


@dataclass
class Table:
    """Rows under headings, in order of measurement; printed as they come."""

    sections: dict[str, list[Row]] = field(default_factory=dict)

    def section(self, title: str) -> None:
        """Begin a new part."""
        self.sections[title] = []
        print(f"\n{title}", flush=True)

    def add(self, name: str, unit: str, values: list[float] | float, **more: Any) -> Row:
        """Record and print one row. more: ratio, bar, note."""
        row = Row(name=name, unit=unit, values=values if isinstance(values, list) else [values], **more)
        list(self.sections.values())[-1].append(row)
        spread = f"{min(row.values):.4g}..{max(row.values):.4g}" if len(row.values) > 1 else ""
        ratio = "" if row.ratio is None else f"x {row.ratio:.4g}"
        bar = "" if row.bar is None else f"bar {row.bar:g} {unit} {row.verdict}"
        words = "; ".join(filter(None, (bar, row.note)))
        line = f"  {name:<58} {row.median:>11.5g} {unit:<10} {spread:<22} {ratio:<11} {words}"
        print(line.rstrip(), flush=True)
        return row

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {title: [row.as_dict() for row in rows] for title, rows in self.sections.items()}


Clock = Callable[[], float]

WALL: Clock = time.perf_counter
"""What a user waits for; longer when other processes want the cores too."""
CPU: Clock = time.process_time
"""What this process was given: comparable on a busy machine, but the sum over threads."""


def durations(function: Callable[[], object], repetitions: int, clock: Clock = CPU) -> list[float]:
    """Time of each call [s], after one call that is not counted."""
    function()
    found = []
    for _ in range(repetitions):
        start = clock()
        function()
        found.append(clock() - start)
    return found


def rates(amount: float, seconds: list[float]) -> list[float]:
    """amount per second for each duration."""
    return [amount / each for each in seconds]
