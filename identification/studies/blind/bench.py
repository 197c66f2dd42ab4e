"""The blind check's bench: a trial's true recordings, with forms and solver that no fit uses."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.coefficients import coefficients, effect_sizes
from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters
from epv_env.plant.readings import readings
from identification.bench.measurement import (
    RESERVOIR_VOLUME,
    TrueSignals,
    initial_state,
    measured_campaign,
)
from identification.bench.programmes import DIAGNOSIS_SUITE, Programme
from identification.bench.reference_simulation import simulate_reference
from identification.bench.schedule import Schedule, piecewise_schedule
from identification.recordings.recording import Campaign
from identification.report_2003.cases import SAMPLING_RATE
from identification.studies.blind.deviating_forms import right_hand_side, terminal_currents
from identification.studies.blind.truth import Trial

LEFT_OUT = ("rest", "high_voltage")
"""A record at rest would take away a constant sensor bias, which is one of the effects to be found."""

SUPPLY_VOLTAGE = 24.0
"""Of the coil in every recording [V]: a drop of the driver's can hide behind the resistance."""

SUITE = tuple(
    replace(programme, U_on=SUPPLY_VOLTAGE)
    for programme in DIAGNOSIS_SUITE
    if programme.name not in LEFT_OUT
)
"""Nine recordings, two of them held out."""

ZEROED: dict[str, float] = {}
"""Offsets of the bench's own sensors: zeroed before the session, as the bias is an effect."""

SOLVERS = (("LSODA", 1e-6), ("LSODA", 1e-8), ("Radau", 1e-6), ("Radau", 1e-8))
"""SciPy's methods and relative tolerances, tried in turn: LSODA's interpolant may lose an event."""

MOST_EVALUATIONS = 3e5
"""Of one recording; a mover that chatters between sticking and slipping would have no end of them."""

WARMING = 3.0
"""Recordings after which a winding is within 1/e of its warmest."""


def true_recordings(trial: Trial, seed: int) -> list[TrueSignals]:
    """The noise-free course of every recording. Raises RuntimeError if no solver gets through.

    seed: of the winding's temperatures and of the jitter of delays.
    """
    return [
        run_programme(
            trial.parameters.replace(theta_coil=_winding(trial, index, seed)),
            programme,
            deviation=trial.deviation,
            rng=np.random.default_rng([seed, trial.number, index, 2]),
        )
        for index, programme in enumerate(SUITE)
    ]


def blind_campaign(truths: list[TrueSignals], trial: Trial, seed: int) -> Campaign:
    """What the bench's sensors make of them; its name says no more than the trial's number."""
    noise = int(np.random.SeedSequence([seed, trial.number, 0, 3]).generate_state(1)[0])
    name = f"trial-{trial.number:04d}"
    return measured_campaign(truths, trial.unit, seed=noise, name=name, offsets=ZEROED)


def run_programme(
    parameters: Parameters, programme: Programme, *, deviation: float, rng: np.random.Generator
) -> TrueSignals:
    """One recording of a valve whose effects deviate in form; at 0 they have the plant's."""
    U = programme.case.voltage(programme.U_on, SAMPLING_RATE)
    time = np.arange(len(U)) / SAMPLING_RATE
    start = initial_state(parameters, programme)
    schedule = piecewise_schedule(parameters, start, time, U=U[:-1], reservoir_volume=RESERVOIR_VOLUME)
    schedule = _delayed(schedule, parameters["t_delay"], deviation, rng)
    state = _solved(schedule, time, deviation)
    return TrueSignals(
        programme=programme,
        period=1.0 / SAMPLING_RATE,
        channels={"U": U, **_read(state, parameters, deviation)},
    )


def _winding(trial: Trial, index: int, seed: int) -> float:
    """How warm the winding is when a recording begins [K]: warmer through the session, not evenly."""
    if trial.warmest == 0:
        return 0.0
    uneven = np.random.default_rng([seed, trial.number, index, 4]).uniform(0.8, 1.2)
    return float(trial.warmest * uneven * (1.0 - np.exp(-(index + 1) / WARMING)))


def _delayed(schedule: Schedule, delay: float, deviation: float, rng: np.random.Generator) -> Schedule:
    """Every switching later by a delay of its own."""
    inner = schedule.borders[1:-1]
    if delay == 0 or len(inner) == 0:
        return schedule
    later = inner + delay * (1.0 + deviation * rng.uniform(-1.0, 1.0, len(inner)))
    end = schedule.duration
    return replace(schedule, borders=np.concatenate([[0.0], np.minimum(later, end), [end]]))


def _solved(schedule: Schedule, time: NDArray, deviation: float) -> State:
    failures = []
    for method, rtol in SOLVERS:
        try:
            state = simulate_reference(
                schedule, time, method=method, rtol=rtol, right_hand_side=right_hand_side(deviation),
                most_evaluations=MOST_EVALUATIONS,
            ).state  # fmt: skip
            return state._replace(I_coil=_currents(state, schedule, time, deviation))
        except (ValueError, RuntimeError) as error:
            failures.append(f"{method} at {rtol:g}: {error}")
    raise RuntimeError(f"no solver followed the bench's valve: {'; '.join(failures)}")


def _currents(state: State, schedule: Schedule, time: NDArray, deviation: float) -> NDArray:
    """Current at the terminals [A], (samples,), as the deviating forms have it."""
    segment = np.searchsorted(schedule.borders[1:-1], time, side="left")
    inputs = np.ascontiguousarray([field[segment] for field in schedule.inputs])
    p = schedule.parameters
    return terminal_currents(
        np.ascontiguousarray(state), inputs, coefficients(p), effect_sizes(p), deviation
    )


def _read(state: State, p: Parameters, deviation: float) -> dict[str, NDArray]:
    """What the sensors are given to read; biases grow with the pressure, the gain with the current."""
    sensors = {
        "b_p2": p["b_p2"] * (1.0 + deviation * (state.p2 / 8e5 - 1.0)),
        "b_p3": p["b_p3"] * (1.0 + deviation * (state.p3 / 8e5 - 1.0)),
        "g_I": p["g_I"] * (1.0 + deviation * (np.abs(state.I_coil) / 0.4 - 1.0)),
    }
    return readings(state, sensors)
