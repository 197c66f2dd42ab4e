"""The blind check's bench: a trial's true recordings, with forms and solver that no fit uses."""

import hashlib
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

from epv_env.plant.channels import readings
from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.coil import coil_current
from epv_env.plant.effects.registry import Effects, effect_constants
from epv_env.plant.equations import State, derivative
from epv_env.plant.lanes import coefficients_at, effects_at, inputs_at, state_at, store_state
from epv_env.plant.parameters import Parameters
from epv_env.plant.primitives import FLAGS, replacing, source_digest
from identification.bench.hybrid_automaton import RightHandSide, Schedule, piecewise_schedule
from identification.bench.programmes import DIAGNOSIS_SUITE, Programme
from identification.bench.reference_simulation import simulate_reference
from identification.bench.session import (
    RESERVOIR_VOLUME,
    TrueSignals,
    initial_state,
    measured_campaign,
)
from identification.blind import forms
from identification.blind.forms import (
    INSTANT_DROP,
    IRON_TIME_CONSTANT,
    LANGEVIN,
    OTHER_FORMS,
    deviating_sizes,
    film_rate,
    instant_drop,
    langevin_current_rate,
    langevin_size,
)
from identification.blind.truth import Trial
from identification.recordings.recording import Campaign
from identification.report_2003.cases import SAMPLING_RATE

OMITTED_PROGRAMMES = ("rest", "high_voltage")
"""Programmes of the diagnosis suite that are not run. A record at rest would remove a constant sensor
bias, which is one of the effects."""

SUPPLY_VOLTAGE = 24.0
"""Coil voltage in every recording [V]: the driver's drop can hide behind the resistance."""

SOLVERS = (("LSODA", 1e-6), ("LSODA", 1e-8), ("Radau", 1e-6), ("Radau", 1e-8))
"""SciPy's methods with relative tolerances [-], tried in turn: LSODA's interpolant may lose an event."""

SOLVER_EVALUATIONS = 3e5
"""Most evaluations of the right-hand side for one recording [-]: a mover that chatters between sticking
and slipping would need infinitely many."""

WARM_UP_RECORDINGS = 3.0
"""Recordings after which a winding is within 1/e of its highest temperature [-]."""

WARMING_RANGE = (0.8, 1.2)
"""Range of the winding's temperature relative to an even warming [-]."""

NO_OFFSETS: dict[str, float] = {}
"""Offsets of the bench's own sensors. They are zeroed before the session, as a bias is an effect."""

_with_supply_drop = replacing(State, "supply_drop")
_with_saturation = replacing(Effects, "saturation")
_with_rates = replacing(State, "vMV", "coil_heat", "I", "supply_drop")


def _digest() -> str:
    """Of every source that the kernels inline: Numba's cache sees changes of this file only."""
    own = Path(forms.__file__ or "").read_bytes()
    return hashlib.sha256(source_digest().encode() + own).hexdigest()


def _compile(digest: str):
    """Rates and terminal currents as compiled functions; a changed digest compiles them anew."""

    @numba.njit(cache=True, **FLAGS)
    def rates_and_forces(y, u, c, e, free_PV, free_MV, d, instant, langevin):
        out = np.empty(y.size + 2)
        if digest == "":
            return out
        q, inputs = state_at(y.reshape(-1, 1), 0, 0), inputs_at(u.reshape(-1, 1), 0, 0)
        valve, fitted = coefficients_at(c, 0, 0), effects_at(e, 0, 0)
        if instant:
            q = _with_supply_drop(q, instant_drop(q, inputs, valve, fitted, d))
        deviating = deviating_sizes(q, inputs, valve, fitted, d)
        size = langevin_size(q, valve, deviating) if langevin else deviating.saturation
        sizes = _with_saturation(deviating, size)
        rates, force_PV, force_MV = derivative(q, inputs, valve, sizes, free_PV, free_MV, True)
        slowed = rates.vMV - d * film_rate(q, valve) * q.vMV * free_MV
        cooled = rates.coil_heat - d * q.coil_heat / IRON_TIME_CONSTANT
        current = rates.I
        if langevin:
            current = langevin_current_rate(q, valve, deviating, size, current)
        dropping = 0.0 if instant else rates.supply_drop
        store_state(out.reshape(-1, 1), 0, 0, _with_rates(rates, slowed, cooled, current, dropping))
        out[-2], out[-1] = force_PV, force_MV
        return out

    @numba.njit(cache=True, **FLAGS)
    def currents(states, u, c, e, d):
        out = np.empty(states.shape[1])
        if digest == "":
            return out
        valve, fitted = coefficients_at(c, 0, 0), effects_at(e, 0, 0)
        for k in range(out.size):
            q, inputs = state_at(states, 0, k), inputs_at(u, 0, k)
            sizes = deviating_sizes(q, inputs, valve, fitted, d)
            out[k] = coil_current(inputs.U, q.I, valve.R, q.coil_heat, sizes)
        return out

    return rates_and_forces, currents


_rates_and_forces, _terminal_currents = _compile(_digest())


def right_hand_side(form_deviation: float, forms: Collection[str] = ()) -> RightHandSide:
    """The plant with effects of the bench's forms, for `simulate_reference`.

    Args:
        form_deviation: share by which the forms deviate [-].
        forms: effects that have their other form.

    Raises:
        ValueError: an effect has no other form.
    """
    strange = sorted(set(forms) - set(OTHER_FORMS))
    if strange:
        raise ValueError(
            f"{strange[0]} has no other form: choose among {', '.join(OTHER_FORMS)}, or add the form to "
            "forms.py"
        )
    instant, langevin = INSTANT_DROP in forms, LANGEVIN in forms

    def rates_and_forces(y, u, c, e, free_PV, free_MV):
        return _rates_and_forces(y, u, c, e, free_PV, free_MV, form_deviation, instant, langevin)

    return rates_and_forces


def terminal_currents(state: State, schedule: Schedule, time: NDArray, form_deviation: float) -> NDArray:
    """Currents at the coil's terminals [A], (samples,), where eddy currents deviate as well.

    Args:
        state: fields (samples,) each [SI].
        schedule: the inputs and the valve.
        time: of the samples [s], (samples,).
        form_deviation: relative deviation of the forms [-].
    """
    segment = np.searchsorted(schedule.borders[1:-1], time, side="left")
    inputs = np.ascontiguousarray([field[segment] for field in schedule.inputs])
    c, e = coefficients(schedule.parameters), effect_constants(schedule.parameters)
    return _terminal_currents(np.ascontiguousarray(state), inputs, c, e, form_deviation)


def blind_suite() -> tuple[Programme, ...]:
    """The programmes of a campaign: nine recordings, two of them held out."""
    return tuple(
        replace(programme, U_on=SUPPLY_VOLTAGE)
        for programme in DIAGNOSIS_SUITE
        if programme.name not in OMITTED_PROGRAMMES
    )


def true_recordings(trial: Trial, seed: int) -> list[TrueSignals]:
    """The noise-free course of every recording.

    Args:
        trial: the truth.
        seed: of the winding's temperatures and of the jitter of delays.

    Raises:
        RuntimeError: no solver follows the valve.
    """
    return [
        run_programme(
            trial.parameters.replace(theta_coil=_start_temperature(trial, index, seed)),
            programme,
            form_deviation=trial.form_deviation,
            other_forms=trial.other_forms,
            rng=np.random.default_rng([seed, trial.number, index, 2]),
        )
        for index, programme in enumerate(blind_suite())
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
) -> TrueSignals:
    """One recording of a valve whose effects deviate in form; at deviation 0 the forms are the plant's.

    Args:
        parameters: the valve.
        programme: inputs and start.
        form_deviation: relative deviation of the forms [-].
        rng: of the jitter of delays.
        other_forms: effects that have their other form.

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
    state = _simulated(schedule, time, rates)
    state = state._replace(I_coil=terminal_currents(state, schedule, time, form_deviation))
    return TrueSignals(
        programme=programme,
        period=1.0 / SAMPLING_RATE,
        channels={"U": U, **_sensed(state, parameters, form_deviation)},
    )


def _start_temperature(trial: Trial, index: int, seed: int) -> float:
    """Winding temperature above ambient when a recording begins [K]; rises unevenly in the session."""
    if trial.winding_temperature_rise == 0:
        return 0.0
    rng = np.random.default_rng([seed, trial.number, index, 4])
    uneven = rng.uniform(*WARMING_RANGE)
    warmed = 1.0 - np.exp(-(index + 1) / WARM_UP_RECORDINGS)
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


def _simulated(schedule: Schedule, time: NDArray, rates: RightHandSide) -> State:
    """States at the times [s], (samples,), by the first solver that succeeds."""
    failures = []
    for method, rtol in SOLVERS:
        try:
            return simulate_reference(
                schedule,
                time,
                method=method,
                rtol=rtol,
                right_hand_side=rates,
                most_evaluations=SOLVER_EVALUATIONS,
            ).state
        except (ValueError, RuntimeError) as error:
            failures.append(f"{method} at {rtol:g}: {error}")
    raise RuntimeError(f"no solver followed the bench's valve: {'; '.join(failures)}")


def _sensed(state: State, p: Parameters, form_deviation: float) -> dict[str, NDArray]:
    """Sensor inputs by channel [SI], (samples,): biases grow with pressure, the gain with current."""
    sensors = {
        "b_p2": p["b_p2"] * (1.0 + form_deviation * (state.p2 / 8e5 - 1.0)),
        "b_p3": p["b_p3"] * (1.0 + form_deviation * (state.p3 / 8e5 - 1.0)),
        "g_I": p["g_I"] * (1.0 + form_deviation * (np.abs(state.I_coil) / 0.4 - 1.0)),
    }
    return readings(state, sensors)
