"""What every sensitivity study runs: the report's test cases for a batch of parameter variants."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.equations import State
from epv_env.plant.simulate import Trajectory, energised, simulate
from identification.recordings.recording import OUTPUTS
from identification.report_2003.cases import (
    CALIBRATION_CASES,
    CIRCUIT_PRESSURE,
    ENERGISED_VOLTAGE,
    SAMPLING_RATE,
    SUPPLY_PRESSURE,
    Case,
)
from identification.report_2003.output_error import partial_error, relative_error, total_error


class Simulator(Protocol):
    """`epv_env.plant.simulate.simulate`, or another numerical method for the same equations."""

    def __call__(
        self, p: Mapping[str, ArrayLike], *, initial: State, U: ArrayLike, period: float
    ) -> Trajectory:
        """States at the samples of U, which are `period` [s] apart."""
        ...


@dataclass(frozen=True, kw_only=True)
class StudyConditions:
    """What the report does not print about its study; the values are fitted to Tables 8 and 9."""

    p1: float = SUPPLY_PRESSURE
    """Input chamber pressure, constant [Pa absolute]."""
    p2: float = CIRCUIT_PRESSURE
    """Output chamber pressure at the start [Pa absolute]."""
    U_on: float = ENERGISED_VOLTAGE
    """Voltage that holds the armature [V]."""
    cases: tuple[Case, ...] = CALIBRATION_CASES


REPORT_CONDITIONS = StudyConditions()
"""Conditions that fit Tables 8 and 9 best."""


def run_cases(
    p: Mapping[str, ArrayLike],
    conditions: StudyConditions = REPORT_CONDITIONS,
    simulator: Simulator = simulate,
) -> list[Trajectory]:
    """Each test case from the energised steady state, for all variants at once.

    p: parameters by symbol [SI], arrays (n,). Raises epv_env.plant.simulate.SimulationError.
    """
    start = energised(p, p1=conditions.p1, p2=conditions.p2, U=conditions.U_on)
    return [
        simulator(
            p, initial=start, U=case.voltage(conditions.U_on, SAMPLING_RATE), period=1 / SAMPLING_RATE
        )
        for case in conditions.cases
    ]


def output_samples(run: Trajectory) -> list[NDArray]:
    """p2, p3 [Pa] and I [A], each (samples, n)."""
    return [np.asarray(getattr(run.state, name)) for name in OUTPUTS]


def total_errors(
    p: Mapping[str, ArrayLike],
    conditions: StudyConditions = REPORT_CONDITIONS,
    simulator: Simulator = simulate,
) -> NDArray:
    """Total error (eq. 21) of variants 1, 2, .. against variant 0, as fractions, (n - 1,).

    p: parameters by symbol [SI], arrays (n,). Raises SimulationError.
    """
    partials = []
    for run in run_cases(p, conditions, simulator):
        errors = [relative_error(y[:, 0], y[:, 1:], run.time) for y in output_samples(run)]
        partials.append(partial_error(errors))
    return total_error(partials)
