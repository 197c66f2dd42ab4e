"""Schedules of the tests, and the plant run on a schedule."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters
from epv_env.plant.runge_kutta import DEFAULT_STEP
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves
from tests.reference.hybrid_automaton import Schedule, piecewise_schedule
from tests.reference.reference_simulation import ReferenceRun

MOST_STEPS = 5000
"""Steps that one `advance` is asked for; well below integrate.MAX_STEPS."""


def pulses(
    parameters: Parameters,
    *,
    opening: float,
    count: int,
    duration: float,
    pause: float = 0.209,
    p1: float = 12.54e5,
    p2: float = 6.81e5,
    U_on: float = 24.0,
) -> Schedule:
    """Energised, then from 0.05 s on `count` deactivations of `opening` [s], `pause` [s] apart."""
    starts = 0.05 + (opening + pause) * np.arange(count)
    borders = np.concatenate([[0.0], np.stack([starts, starts + opening], 1).ravel(), [duration]])
    return piecewise_schedule(
        parameters,
        energised(parameters, p1=p1, p2=p2, U=U_on),
        borders,
        U=np.where(np.arange(len(borders) - 1) % 2 == 0, U_on, 0.0),
    )


def report_tests(parameters: Parameters, U_on: float = 24.0) -> dict[str, Schedule]:
    """Tests 1-4 and the validation of the report, by the name of their file in shared/reference."""
    return {
        "test1": pulses(parameters, opening=0.090, count=2, duration=0.65, U_on=U_on),
        "test2": pulses(parameters, opening=0.100, count=2, duration=0.65, U_on=U_on),
        "test3": pulses(parameters, opening=0.110, count=2, duration=0.65, U_on=U_on),
        "test4": pulses(parameters, opening=0.090, count=1, duration=1.05, U_on=U_on),
        "validation": pulses(
            parameters, opening=0.110, count=3, pause=0.1, duration=0.75, p2=6.0e5, U_on=U_on
        ),
    }


def plant_states(schedule: Schedule, times: ArrayLike, *, step: float = DEFAULT_STEP) -> State:
    """The plant's states at `times` [s], fields of shape (times,).

    Every time has a valve of its own, which stops there: so samples shorten no step but the last.
    """
    times = np.asarray(times, dtype=float)
    valves = Valves.started(
        len(times), schedule.parameters, schedule.initial, reservoir_volume=schedule.reservoir_volume,
        step=step, threads=1,
    )  # fmt: skip
    for segment, (start, end) in enumerate(
        zip(schedule.borders[:-1], schedule.borders[1:], strict=True)
    ):
        for field, value in zip(valves.inputs, schedule.inputs, strict=True):
            field[:] = value[segment]
        parts = math.ceil((end - start) / (MOST_STEPS * step))
        for first, last in pairwise(np.linspace(start, end, parts + 1)):
            valves.advance(np.clip(times - first, 0.0, last - first))
    return State(*(field.copy() for field in valves.state))


def sample_times(schedule: Schedule, period: float) -> NDArray:
    """0, period, 2 period .. up to the end of the schedule [s]."""
    count = math.floor(schedule.duration / period + 1e-6)
    return np.minimum(np.arange(count + 1) * period, schedule.duration)


def away_from_events(run: ReferenceRun, margin: float, name_part: str = "") -> NDArray:
    """Whether each sample is farther than margin [s] from the named events, boolean (samples,)."""
    at = np.array([event.time for event in run.events if name_part in event.name])
    return np.all(np.abs(run.time[:, None] - at) > margin, axis=1)


def largest_difference(one: NDArray, other: NDArray, keep: NDArray | Sequence[bool]) -> float:
    """Largest absolute difference where `keep` holds."""
    return float(np.max(np.abs(one - other)[np.asarray(keep)]))
