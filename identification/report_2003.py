"""What the 2003 report defines: test cases and output error."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import trapezoid


@dataclass(frozen=True, kw_only=True)
class Case:
    """A test case (section 5.2.1): when the coil is switched off.

    Times that the report does not print are fitted to its tables.
    """

    name: str
    """Of the test case."""
    openings: tuple[float, ...]
    """Lengths of the deactivations [s]."""
    duration: float
    """Of the recording [s]."""
    first: float = 0.05
    """Start of the first deactivation [s]."""
    pause: float = 0.209
    """From the end of a deactivation to the start of the next [s]."""

    def voltage(self, U_on: float, rate: float) -> NDArray:
        """Voltage at `rate` samples per second [V], (samples,); exact in whole sample counts."""
        U = np.full(round(self.duration * rate) + 1, U_on)
        start = self.first
        for opening in self.openings:
            first = round(start * rate)
            U[first : first + round(opening * rate)] = 0.0
            start += opening + self.pause
        return U


CALIBRATION_CASES = (
    Case(name="Test1", openings=(0.09, 0.09), duration=0.65),
    Case(name="Test2", openings=(0.10, 0.10), duration=0.65),
    Case(name="Test3", openings=(0.11, 0.11), duration=0.65),
    Case(name="Test4", openings=(0.09,), duration=1.05),
)
"""Tests that the report calibrates with."""


# Three such pulses fit into 0.75 s with a shorter pause only; its length is a choice of this project.
VALIDATION_CASE = Case(name="Validation", openings=(0.11, 0.11, 0.11), duration=0.75, pause=0.1)
"""Test that the report holds out."""

SAMPLING_RATE = 2000.0
"""Samples per second of the report's bench (section 3)."""

ACCEPTED_ERROR = 0.1
"""Total and partial error that the report accepts (sections 6.1 and 7), a fraction."""

SUPPLY_PRESSURE, CIRCUIT_PRESSURE, ENERGISED_VOLTAGE = 12.54e5, 6.81e5, 18.9
"""p1 and p2 at the start [Pa absolute], U_on [V]: not printed, found by fitting Tables 8 and 9."""


def relative_error(reference: NDArray, modified: NDArray, time: NDArray) -> NDArray:
    """Error of one output in one test, as a fraction (eq. 19).

    Root of the time mean of ((reference - modified) / mean of the reference)^2. reference: (samples,).
    modified: (samples,) or, for n variants, (samples, n). time: (samples,) [s]. Returns () or (n,).
    """
    duration = time[-1] - time[0]
    mean = trapezoid(reference, time) / duration
    deviation = (modified.T - reference) / mean
    return np.sqrt(trapezoid(deviation**2, time) / duration)


def partial_error(errors: Sequence[NDArray]) -> NDArray:
    """Error of one test, a fraction, from those of its outputs, each () or (n,) (eq. 20)."""
    return np.sqrt(sum(np.square(error) for error in errors))


def total_error(partial_errors: Sequence[NDArray]) -> NDArray:
    """Root mean square of the tests' partial errors, fractions () or (n,) each (eq. 21)."""
    return np.sqrt(np.mean(np.square(partial_errors), axis=0))
