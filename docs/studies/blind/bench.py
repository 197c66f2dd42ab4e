"""The blind check's bench: a trial's true recordings, with forms and solver that no fit uses."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from docs.studies.blind.forms import currents_at_terminals, right_hand_side
from docs.studies.blind.truth import Trial
from epv_env.plant.channels import readings
from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.registry import effect_constants
from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters
from identification.bench.programmes import DIAGNOSIS_SUITE, Programme
from identification.bench.session import (
    RESERVOIR_VOLUME,
    TrueSignals,
    initial_state,
    measured_campaign,
)
from identification.recordings.recording import Campaign
from identification.report_2003 import SAMPLING_RATE
from tests.reference.hybrid_automaton import (
    RightHandSide,
    Schedule,
    delayed_schedule,
    edge_delays,
    piecewise_schedule,
)
from tests.reference.reference_simulation import simulate_reference

SUITE = tuple(
    replace(programme, U_on=24.0)
    for programme in DIAGNOSIS_SUITE
    if programme.name not in ("rest", "high_voltage")
)
"""The programmes of a campaign: nine recordings, two of them held out, all at one voltage, behind which
the driver's drop can hide. A record at rest would remove a constant sensor bias, which is an effect."""

NO_OFFSETS: dict[str, float] = {}
"""Offsets of the bench's own sensors. They are zeroed before the session, as a bias is an effect."""


def true_recordings(trial: Trial, seed: int, suite: Sequence[Programme] = SUITE) -> list[TrueSignals]:
    """The noise-free course of every recording.

    seed: of the winding's temperatures and of the jitter of delays. Raises RuntimeError where no solver
    follows the valve.
    """
    return [
        run_programme(
            trial.parameters.replace(theta_coil=_start_temperature(trial, index, seed)),
            programme,
            form_deviation=trial.form_deviation,
            other_forms=trial.other_forms,
            rng=np.random.default_rng([seed, trial.number, index, 2]),
        )
        for index, programme in enumerate(suite)
    ]


def blind_campaign(truths: Sequence[TrueSignals], trial: Trial, seed: int) -> Campaign:
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
) -> TrueSignals:
    """One recording of a valve whose effects deviate in form; at deviation 0 the forms are the plant's.

    form_deviation: relative deviation of the forms [-]. rng: of the jitter of delays. other_forms:
    effects that have their other form. Raises RuntimeError where no solver follows the valve.
    """
    U = programme.case.voltage(programme.U_on, SAMPLING_RATE)
    time = np.arange(len(U)) / SAMPLING_RATE
    start = initial_state(parameters, programme)
    schedule = piecewise_schedule(parameters, start, time, U=U[:-1], reservoir_volume=RESERVOIR_VOLUME)
    delays = edge_delays(schedule)
    if np.any(delays):  # each switching is later by a delay of its own, by a controller's cycle
        delays = delays * (1.0 + form_deviation * rng.uniform(-1.0, 1.0, len(delays)))
    schedule = delayed_schedule(schedule, delays)
    state = _simulated(schedule, time, right_hand_side(form_deviation, other_forms))
    segment = np.searchsorted(schedule.borders[1:-1], time, side="left")
    inputs = np.ascontiguousarray([field[segment] for field in schedule.inputs])
    c, e = coefficients(parameters), effect_constants(parameters)
    current = currents_at_terminals(np.ascontiguousarray(state), inputs, c, e, form_deviation)
    channels = {"U": U, **_sensed(state._replace(I_coil=current), parameters, form_deviation)}
    return TrueSignals(programme=programme, period=1.0 / SAMPLING_RATE, channels=channels)


def _start_temperature(trial: Trial, index: int, seed: int) -> float:
    """Winding temperature above ambient when a recording begins [K]; rises unevenly in the session.

    After three recordings it is within 1/e of the highest temperature.
    """
    uneven = np.random.default_rng([seed, trial.number, index, 4]).uniform(0.8, 1.2)
    warmed = 1.0 - np.exp(-(index + 1) / 3.0)
    return float(trial.winding_temperature_rise * uneven * warmed)


def _simulated(schedule: Schedule, time: NDArray, rates: RightHandSide) -> State:
    """States at the times [s], (samples,), by the first solver that succeeds.

    LSODA's interpolant may lose an event; a mover that chatters between sticking and slipping would need
    infinitely many evaluations.
    """
    failures = []
    for method, rtol in (("LSODA", 1e-6), ("LSODA", 1e-8), ("Radau", 1e-6), ("Radau", 1e-8)):
        own = {"method": method, "rtol": rtol, "most_evaluations": 3e5}
        try:
            return simulate_reference(schedule, time, right_hand_side=rates, **own).state
        except (ValueError, RuntimeError) as error:
            failures.append(f"{method} at {rtol:g}: {error}")
    raise RuntimeError(f"no solver followed the bench's valve: {'; '.join(failures)}")


def _sensed(state: State, p: Parameters, form_deviation: float) -> dict[str, NDArray]:
    """Sensor inputs by channel [SI], (samples,): errors grow with the reading (curved sensors)."""
    p1, p2, p3 = (1.0 + form_deviation * (own / 8e5 - 1.0) for own in (state.p1, state.p2, state.p3))
    sensors = {
        "g_p1": p["g_p1"] * p1,
        "b_p2": p["b_p2"] * p2,
        "g_p2": p["g_p2"] * p2,
        "b_p3": p["b_p3"] * p3,
        "g_p3": p["g_p3"] * p3,
        "g_I": p["g_I"] * (1.0 + form_deviation * (np.abs(state.I_coil) / 0.4 - 1.0)),
    }
    return readings(state, sensors)
