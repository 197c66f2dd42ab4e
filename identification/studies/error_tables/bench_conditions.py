"""Conditions under which the real valve may have been tested: what is printed, and ranges for the rest.

The report prints the lengths of the deactivations, the validation test's duration and the sampling rate.
Everything else is drawn: uniform about the values that fit Tables 8 and 9, within what the axes of
Figures 10 to 14 allow.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.replay.model_inputs import ModelInputs
from identification.report_2003.cases import (
    CALIBRATION_CASES,
    CIRCUIT_PRESSURE,
    ENERGISED_VOLTAGE,
    SAMPLING_RATE,
    SUPPLY_PRESSURE,
    VALIDATION_CASE,
    Case,
)

CASES = (*CALIBRATION_CASES, VALIDATION_CASE)
"""Tests 1 to 4, to which the four parameters are fitted, and the validation test."""

N_FITTED = len(CALIBRATION_CASES)


@dataclass(frozen=True, kw_only=True)
class Uncertainty:
    """Half widths about the fitted values: of all tests together, and of each test beside that."""

    together: float
    each: float

    def draw(self, rng: np.random.Generator, n: int) -> NDArray:
        """Departures of n tests, (n,)."""
        return rng.uniform(-self.together, self.together) + rng.uniform(-self.each, self.each, n)


VOLTAGES = Uncertainty(together=1.0, each=0.15)
"""U_on [V]: the supply is set once, the coil's share drifts with its temperature."""
SUPPLIES = Uncertainty(together=0.4e5, each=0.1e5)
"""p1 [Pa]."""
CIRCUITS = Uncertainty(together=0.4e5, each=0.3e5)
"""p2 at the start [Pa]: every test leaves more air in the circuit than it found."""
FIRSTS = Uncertainty(together=0.02, each=0.005)
"""Start of the first deactivation [s]; the records begin in steady state."""
PAUSES = Uncertainty(together=0.04, each=0.0)
"""From the end of a deactivation to the start of the next [s]; of the validation test, a half of it."""
DURATIONS = Uncertainty(together=0.03, each=0.0)
"""Of tests 1 to 4 [s]: the axes of Figures 10 to 13 end between 0.6 and 0.7 s, and 1.0 and 1.1 s."""
TEMPERATURES = Uncertainty(together=0.0, each=1.0)
"""Relative departure of each test's winding temperature, for a coil that is not always equally warm."""


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """Conditions of the five tests, in the order of CASES; arrays (5,), SI units."""

    cases: tuple[Case, ...]
    U_on: NDArray
    p1: NDArray
    p2: NDArray
    warmth: NDArray
    """Departure of the winding's temperature from its mean over tests 1 to 4, within ±1 or so."""

    @property
    def drives(self) -> list[ModelInputs]:
        """What the five tests impose on the model."""
        return [
            _drive(case, *values)
            for case, *values in zip(self.cases, self.U_on, self.p1, self.p2, strict=True)
        ]


def fitted_conditions() -> Conditions:
    """The conditions that fit Tables 8 and 9; the winding grows warmer from test to test."""
    n = len(CASES)
    return Conditions(
        cases=CASES, U_on=np.full(n, ENERGISED_VOLTAGE),
        p1=np.full(n, SUPPLY_PRESSURE), p2=np.full(n, CIRCUIT_PRESSURE),
        warmth=_centred(np.linspace(-1.0, 1.0, n)),
    )  # fmt: skip


def drawn_conditions(rng: np.random.Generator) -> Conditions:
    """Conditions drawn from the ranges above."""
    n = len(CASES)
    return Conditions(
        U_on=ENERGISED_VOLTAGE + VOLTAGES.draw(rng, n),
        p1=SUPPLY_PRESSURE + SUPPLIES.draw(rng, n),
        p2=CIRCUIT_PRESSURE + CIRCUITS.draw(rng, n),
        cases=_drawn_cases(rng),
        warmth=_centred(TEMPERATURES.draw(rng, n)),
    )


def _drawn_cases(rng: np.random.Generator) -> tuple[Case, ...]:
    n = len(CASES)
    first, pause, duration = FIRSTS.draw(rng, n), PAUSES.draw(rng, n), DURATIONS.draw(rng, n)
    pause[-1] *= 0.5  # three pulses must fit into 0.75 s
    duration[-1] = 0.0  # printed
    return tuple(
        replace(case, first=case.first + a, pause=case.pause + b, duration=case.duration + c)
        for case, a, b, c in zip(CASES, first, pause, duration, strict=True)
    )


def _centred(warmth: NDArray) -> NDArray:
    """Less the mean of the fitted tests, which R absorbs."""
    return warmth - np.mean(warmth[:N_FITTED])


def _drive(case: Case, U_on: float, p1: float, p2: float) -> ModelInputs:
    U = case.voltage(U_on, SAMPLING_RATE)
    return ModelInputs(
        period=1.0 / SAMPLING_RATE, U=U, p1=np.full(len(U), p1), sigma_S=np.zeros(len(U)), U_start=U_on,
        p2_start=p2,
    )  # fmt: skip
