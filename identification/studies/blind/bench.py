"""The blind check's bench: a trial's true recordings, with forms and solver that no fit uses."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.channels import readings
from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.registry import effect_constants
from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters
from identification.bench.hybrid_automaton import RightHandSide, Schedule, piecewise_schedule
from identification.bench.programmes import DIAGNOSIS_SUITE, Programme
from identification.bench.reference_simulation import simulate_reference
from identification.bench.session import (
    RESERVOIR_VOLUME,
    TrueSignals,
    initial_state,
    measured_campaign,
)
from identification.recordings.recording import Campaign
from identification.report_2003.cases import SAMPLING_RATE
from identification.studies.blind.bench_rates import right_hand_side, terminal_currents
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.studies.blind.truth import Trial

NO_OFFSETS: dict[str, float] = {}
"""Offsets of the bench's own sensors. They are zeroed before the session, as a bias is an effect."""


def blind_suite(settings: BlindSettings = DEFAULTS) -> tuple[Programme, ...]:
    """The programmes of a campaign: nine recordings, two of them held out."""
    return tuple(
        replace(programme, U_on=settings.supply_voltage)
        for programme in DIAGNOSIS_SUITE
        if programme.name not in settings.omitted_programmes
    )


def true_recordings(trial: Trial, seed: int, settings: BlindSettings = DEFAULTS) -> list[TrueSignals]:
    """The noise-free course of every recording.

    Args:
        trial: the truth.
        seed: of the winding's temperatures and of the jitter of delays.
        settings: of the bench.

    Raises:
        RuntimeError: no solver follows the valve.
    """
    return [
        run_programme(
            trial.parameters.replace(theta_coil=_start_temperature(trial, index, seed, settings)),
            programme,
            form_deviation=trial.form_deviation,
            other_forms=trial.other_forms,
            rng=np.random.default_rng([seed, trial.number, index, 2]),
            settings=settings,
        )
        for index, programme in enumerate(blind_suite(settings))
    ]


def blind_campaign(truths: list[TrueSignals], trial: Trial, seed: int) -> Campaign:
    """The readings of the bench's sensors; the campaign's name holds the trial's number only."""
    noise = int(np.random.SeedSequence([seed, trial.number, 0, 3]).generate_state(1)[0])
    name = f"trial-{trial.number:04d}"
    return measured_campaign(truths, trial.unit, seed=noise, name=name, offsets=NO_OFFSETS)


def run_programme(
    parameters: Parameters,
    programme: Programme,
    *,
    form_deviation: float,
    rng: np.random.Generator,
    other_forms: Collection[str] = (),
    settings: BlindSettings = DEFAULTS,
) -> TrueSignals:
    """One recording of a valve whose effects deviate in form; at deviation 0 the forms are the plant's.

    Args:
        parameters: the valve.
        programme: inputs and start.
        form_deviation: relative deviation of the forms [-].
        rng: of the jitter of delays.
        other_forms: effects that have their other form.
        settings: the solvers.

    Raises:
        RuntimeError: no solver follows the valve.
        ValueError: an effect has no other form.
    """
    U = programme.case.voltage(programme.U_on, SAMPLING_RATE)
    time = np.arange(len(U)) / SAMPLING_RATE
    start = initial_state(parameters, programme)
    schedule = piecewise_schedule(parameters, start, time, U=U[:-1], reservoir_volume=RESERVOIR_VOLUME)
    schedule = _delayed(schedule, parameters["t_delay"], form_deviation, rng)
    rates = right_hand_side(form_deviation, other_forms)
    state = _simulated(schedule, time, rates, settings)
    state = state._replace(I_coil=_terminal_currents(state, schedule, time, form_deviation))
    return TrueSignals(
        programme=programme,
        period=1.0 / SAMPLING_RATE,
        channels={"U": U, **_sensed(state, parameters, form_deviation)},
    )


def _start_temperature(trial: Trial, index: int, seed: int, settings: BlindSettings) -> float:
    """Winding temperature above ambient when a recording begins [K]; rises unevenly in the session."""
    if trial.winding_temperature_rise == 0:
        return 0.0
    rng = np.random.default_rng([seed, trial.number, index, 4])
    uneven = rng.uniform(*settings.warming_range)
    warmed = 1.0 - np.exp(-(index + 1) / settings.warm_up_recordings)
    return float(trial.winding_temperature_rise * uneven * warmed)


def _delayed(
    schedule: Schedule, delay: float, form_deviation: float, rng: np.random.Generator
) -> Schedule:
    """The schedule with every switching later by a delay of its own. delay: their mean [s]."""
    inner = schedule.borders[1:-1]
    if delay == 0 or len(inner) == 0:
        return schedule
    later = inner + delay * (1.0 + form_deviation * rng.uniform(-1.0, 1.0, len(inner)))
    end = schedule.duration
    return replace(schedule, borders=np.concatenate([[0.0], np.minimum(later, end), [end]]))


def _simulated(
    schedule: Schedule, time: NDArray, rates: RightHandSide, settings: BlindSettings
) -> State:
    """States at the times [s], (samples,), by the first solver that succeeds."""
    failures = []
    for method, rtol in settings.solvers:
        try:
            return simulate_reference(
                schedule,
                time,
                method=method,
                rtol=rtol,
                right_hand_side=rates,
                most_evaluations=settings.solver_evaluations,
            ).state
        except (ValueError, RuntimeError) as error:
            failures.append(f"{method} at {rtol:g}: {error}")
    raise RuntimeError(f"no solver followed the bench's valve: {'; '.join(failures)}")


def _terminal_currents(
    state: State, schedule: Schedule, time: NDArray, form_deviation: float
) -> NDArray:
    """Current at the terminals [A], (samples,), with the deviating forms. time: [s], (samples,)."""
    segment = np.searchsorted(schedule.borders[1:-1], time, side="left")
    inputs = np.ascontiguousarray([field[segment] for field in schedule.inputs])
    p = schedule.parameters
    return terminal_currents(
        np.ascontiguousarray(state), inputs, coefficients(p), effect_constants(p), form_deviation
    )


def _sensed(state: State, p: Parameters, form_deviation: float) -> dict[str, NDArray]:
    """Sensor inputs by channel [SI], (samples,): biases grow with pressure, the gain with current."""
    sensors = {
        "b_p2": p["b_p2"] * (1.0 + form_deviation * (state.p2 / 8e5 - 1.0)),
        "b_p3": p["b_p3"] * (1.0 + form_deviation * (state.p3 / 8e5 - 1.0)),
        "g_I": p["g_I"] * (1.0 + form_deviation * (np.abs(state.I_coil) / 0.4 - 1.0)),
    }
    return readings(state, sensors)
