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
from identification.studies.error_tables.settings import DEFAULTS, ErrorTableSettings

CASES = (*CALIBRATION_CASES, VALIDATION_CASE)
"""Tests 1 to 4, to which the four parameters are fitted, and the validation test."""

N_FITTED = len(CALIBRATION_CASES)


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """Conditions of the five tests, in the order of CASES."""

    cases: tuple[Case, ...]
    """Switching times of each test."""
    U_on: NDArray
    """Voltage of the energised coil [V], (5,)."""
    p1: NDArray
    """Supply pressure [Pa], (5,)."""
    p2: NDArray
    """Circuit pressure at the start [Pa], (5,)."""
    winding_deviation: NDArray
    """Winding temperature less its mean over tests 1 to 4 [-], within ±1 or so, (5,)."""

    @property
    def drives(self) -> list[ModelInputs]:
        """Inputs and starts that the five tests impose on the model."""
        return [
            _drive(case, *values)
            for case, *values in zip(self.cases, self.U_on, self.p1, self.p2, strict=True)
        ]


def fitted_conditions() -> Conditions:
    """The conditions that fit Tables 8 and 9; the winding grows warmer from test to test."""
    n = len(CASES)
    return Conditions(
        cases=CASES,
        U_on=np.full(n, ENERGISED_VOLTAGE),
        p1=np.full(n, SUPPLY_PRESSURE),
        p2=np.full(n, CIRCUIT_PRESSURE),
        winding_deviation=_centred(np.linspace(-1.0, 1.0, n)),
    )


def drawn_conditions(rng: np.random.Generator, settings: ErrorTableSettings = DEFAULTS) -> Conditions:
    """Conditions drawn about the fitted ones."""
    n = len(CASES)
    return Conditions(
        U_on=ENERGISED_VOLTAGE + settings.voltage.draw(rng, n),
        p1=SUPPLY_PRESSURE + settings.supply_pressure.draw(rng, n),
        p2=CIRCUIT_PRESSURE + settings.circuit_pressure.draw(rng, n),
        cases=_drawn_cases(rng, settings),
        winding_deviation=_centred(settings.winding_temperature.draw(rng, n)),
    )


def drawn_condition_sets(n: int, seed: int, settings: ErrorTableSettings = DEFAULTS) -> list[Conditions]:
    """The conditions that fit Tables 8 and 9, and n - 1 sets drawn about them."""
    streams = np.random.default_rng(seed).spawn(n - 1)
    return [fitted_conditions(), *(drawn_conditions(rng, settings) for rng in streams)]


def _drawn_cases(rng: np.random.Generator, settings: ErrorTableSettings) -> tuple[Case, ...]:
    n = len(CASES)
    first = settings.first_deactivation.draw(rng, n)
    pause = settings.pause.draw(rng, n)
    duration = settings.duration.draw(rng, n)
    pause[-1] *= settings.validation_pause_share
    duration[-1] = 0.0  # printed
    return tuple(
        replace(case, first=case.first + a, pause=case.pause + b, duration=case.duration + c)
        for case, a, b, c in zip(CASES, first, pause, duration, strict=True)
    )


def _centred(deviation: NDArray) -> NDArray:
    """Less the mean of the fitted tests, which R absorbs."""
    return deviation - np.mean(deviation[:N_FITTED])


def _drive(case: Case, U_on: float, p1: float, p2: float) -> ModelInputs:
    U = case.voltage(U_on, SAMPLING_RATE)
    return ModelInputs(
        period=1.0 / SAMPLING_RATE,
        U=U,
        p1=np.full(len(U), p1),
        sigma_S=np.zeros(len(U)),
        U_start=U_on,
        p2_start=p2,
    )
