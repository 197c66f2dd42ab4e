"""The report's test cases (section 5.2.1): when the coil is switched off, and under what conditions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Case:
    """Deactivations of the coil. Times in s; those that the report does not print are fitted to it."""

    name: str
    opening: float
    """Length of one deactivation."""
    count: int
    duration: float
    first: float = 0.05
    pause: float = 0.209
    """From the end of a deactivation to the start of the next."""

    def voltage(self, U_on: float, rate: float) -> NDArray:
        """Voltage at `rate` samples per second [V], (samples,); exact in whole sample counts."""
        samples = np.arange(round(self.duration * rate) + 1)
        since = samples - round(self.first * rate)
        cycle, opening = round((self.opening + self.pause) * rate), round(self.opening * rate)
        off = (since >= 0) & (since % cycle < opening) & (since < self.count * cycle)
        return np.where(off, 0.0, U_on)


CALIBRATION_CASES = (
    Case(name="Test1", opening=0.09, count=2, duration=0.65),
    Case(name="Test2", opening=0.10, count=2, duration=0.65),
    Case(name="Test3", opening=0.11, count=2, duration=0.65),
    Case(name="Test4", opening=0.09, count=1, duration=1.05),
)
# Three such pulses fit into 0.75 s with a shorter pause only; its length is a choice of this project.
VALIDATION_CASE = Case(name="Validation", opening=0.11, count=3, duration=0.75, pause=0.1)
RATE = 2000.0
"""Samples per second of the report's bench (section 3)."""
