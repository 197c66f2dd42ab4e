"""What the virtual bench simulates with, and which recordings it makes."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class BenchSettings:
    """Judgements of the virtual bench."""

    relative_tolerance: float = 1e-8
    """Of the bench's solver: errors below 0.1 mbar, a thirtieth of an ADC step."""
    least_rate: float = 500.0
    """Least sampling rate [1/s]."""
    greatest_rate: float = 20_000.0
    """Greatest sampling rate [1/s]."""
    longest_recording: float = 60.0
    """Longest recording that the bench makes [s]."""
    shortest_opening: float = 1e-3
    """Shortest time for which the coil is switched off, or on between two openings [s]."""


BENCH = BenchSettings()
"""The default settings."""
