"""Trials of three small virtual plants, on which the diagnosis's probabilities are calibrated.

In the truth a share of each acting law follows another law than the catalogue's, and the truth has an
integrator of its own with finer steps. Values are SI; a cause's size has the cause's name as symbol.
"""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numba
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from docs.studies.calibration.virtual_systems import HIDDEN, SYSTEMS, System, law
from identification.gap.ode_integration import Records
from identification.gap.ode_plant import OdePlant
from identification.gap.plant import Channel, Run

Values = Mapping[str, float | NDArray]
"""By symbol, a number or (runs,) [SI]."""

KINDS = {"none": 0.25, "one": 0.4, "several": 0.2, "stranger": 0.15}
"""Share of the trials by what the nominal model lacks [1]."""

SEVERAL = {2: 0.6, 3: 0.25, 4: 0.15}
"""Share of the trials with several causes by their number [1]."""

DEVIATIONS = {"usual": (0.03, 0.15), "strong": (0.2, 0.5)}
"""Least and largest share of a law that differs from the catalogue's [1]."""

EFFECTS = 1.5, 30.0
"""Least and largest effect of a cause after recalibration, rms [noise deviations]."""

INSIDE = 0.8
"""Largest size of a cause, as a share of the end of its range [1]."""

SAMPLES, HELD_OUT = 300, (False, True, False, True)
"""Samples of each recording, and which recordings are held out."""

SWEPT = 2, 3
"""Recordings in which the command is a sweep; in the others it steps and rests."""

FINER = 10
"""Steps of the truth in a step of the model."""


@dataclass(frozen=True, kw_only=True)
class VirtualTrial:
    """A plant with recordings, and what its nominal model lacks."""

    plant: OdePlant
    kind: str
    """One of KINDS."""
    causes: tuple[str, ...]
    """True causes; of a stranger a name that the catalogue has not."""
    deviation: float
    """Share of each acting law that differs from the catalogue's [1]."""
    values: Values
    """True values by symbol, () or (runs,) [SI]; what is left out is nominal."""


def draw_trial(plant: str, seed: int, number: int, strength: str) -> VirtualTrial:
    """Draw one trial; the same arguments give the same trial.

    Args:
        plant: of SYSTEMS.
        seed: of all trials.
        number: of this trial.
        strength: of DEVIATIONS.
    """
    rng, system = np.random.default_rng([seed, number]), SYSTEMS[plant]
    kind = str(rng.choice([*KINDS], p=[*KINDS.values()]))
    names = [*system.strangers] if kind == "stranger" else [cause.name for cause in system.causes]
    several = int(rng.choice([*SEVERAL], p=[*SEVERAL.values()]))
    count = {"none": 0, "several": several}.get(kind, 1)
    causes = tuple(str(name) for name in rng.choice(names, count, replace=False))
    deviation = rng.uniform(*DEVIATIONS[strength]) if kind in ("one", "several") else 0.0
    commands = [command(system, rng, r) for r in range(len(HELD_OUT))]
    unit = _drawn_unit(system, rng)
    targets = {cause: np.exp(rng.uniform(*np.log(EFFECTS))) for cause in causes}
    sizes = {c: _size(plant, unit, c, deviation, commands, rng, effect) for c, effect in targets.items()}
    exact = true_readings(plant, unit | sizes, deviation, commands)
    channels, measured = _measured(system, rng, exact)
    made = with_recordings(plant, commands, measured, channels)
    return VirtualTrial(plant=made, kind=kind, causes=causes, deviation=deviation, values=unit | sizes)


def with_recordings(
    plant: str, commands: Sequence[NDArray], measured: Sequence[NDArray], channels: Sequence[Channel]
) -> OdePlant:
    """The nominal model with recordings: by run command (samples,), readings (channels, samples)."""
    runs = tuple(
        _run(SYSTEMS[plant], r, *own) for r, own in enumerate(zip(commands, measured, strict=True))
    )
    own = copy(_model(plant))  # Its simulator, which takes seconds to compile, is shared.
    own.runs, own.channels = runs, tuple(channels)
    return own


def true_readings(
    plant: str,
    values: Values,
    deviation: float,
    commands: Sequence[NDArray],
    finer: int = FINER,
) -> list[NDArray]:
    """Exact readings of each run, (channels, samples) [SI].

    Args:
        plant: of SYSTEMS.
        values: by symbol or stranger, () or (runs,) [SI]; what is left out is nominal.
        deviation: share of each law that differs from the catalogue's [1].
        commands: of each run, (samples,) [SI].
        finer: steps in a step of the model.
    """
    system, (records, rate) = SYSTEMS[plant], _truth(plant)
    nominal = dict.fromkeys(records.symbols, 0.0) | _model(plant).nominal
    every = finer * system.steps
    result = []
    for r, given in enumerate(commands):
        own = {s: float(np.broadcast_to(v, len(commands))[r]) for s, v in values.items()}
        p = records.p(**nominal | own | {"deviation": deviation})
        acting = _late(given, every, p.delay / system.period, deviation)
        x = _integrated(
            rate, np.array(system.start(p)), acting, np.array(p), system.period / every, every
        )
        read = system.readings.py_func(records.x(*x.T), records.u(0.0, given), p, deviation)
        result.append(np.array(read))
    return result


def command(system: System, rng: Generator, run: int) -> NDArray:
    """Command (samples,) [SI]: random levels and rests, or a sweep with such amplitudes."""
    holds = rng.integers(SAMPLES // 25, SAMPLES // 8, SAMPLES)
    levels = rng.uniform(-1.0, 1.0, SAMPLES) * (rng.random(SAMPLES) < 0.8)
    levels = np.repeat([0.0, *levels], [SAMPLES // 20, *holds])[:SAMPLES]
    if run in SWEPT:
        frequency = np.linspace(*system.sweep, SAMPLES) * rng.uniform(0.8, 1.2)
        levels = np.abs(levels) * np.sin(2.0 * np.pi * np.cumsum(frequency) * system.period)
    centre, half = system.command
    return centre + half * levels


def _run(system: System, run: int, given: NDArray, measured: NDArray) -> Run:
    return Run(
        name=f"run{run + 1}",
        held_out=HELD_OUT[run],
        time=system.period * np.arange(SAMPLES),
        measured=measured,
        trusted=np.ones(measured.shape, dtype=bool),
        inputs={"command": given},
    )


@cache
def _model(plant: str) -> OdePlant:
    """The nominal model with recordings that say nothing."""
    system = SYSTEMS[plant]
    rate, readings = system.rate, system.readings  # numba compiles no attribute of a record
    empty = np.zeros((len(system.channels), SAMPLES))
    return OdePlant(
        runs=[_run(system, r, np.zeros(SAMPLES), empty) for r in range(len(HELD_OUT))],
        channels=system.channels,
        states=tuple(system.states),
        rate=lambda x, u, p: rate(x, u, p, 0.0, 0.0),
        readings=lambda x, u, p: readings(x, u, p, 0.0),
        start=lambda run, p: system.start(p)[: len(system.states)],
        parameters=system.parameters,
        causes=system.causes,
        run_offsets=system.run_offsets,
        tolerances=system.tolerances,
        components={state: component for state, (component, _) in system.states.items()},
        forcing_steps={state: step for state, (_, step) in system.states.items() if step},
        delays={"command": "delay"},
        steps_per_sample=system.steps,
    )


@cache
def _truth(plant: str) -> tuple[Records, Callable]:
    """Names of the truth, and its compiled rates."""
    system = SYSTEMS[plant]
    symbols = *_model(plant).nominal, *system.strangers, "deviation"
    records = Records((*system.states, *HIDDEN), ("command",), symbols)
    return records, numba.njit(records.flat(system.truth, len(records.states)))


@numba.njit
def _integrated(rate, x, inputs, p, step, every):
    """States at the samples, (samples, states): classical Runge-Kutta, held inputs (steps,)."""
    states, u = np.empty((len(inputs) // every, len(x))), np.empty(1)
    k1, k2, k3, k4 = np.empty(len(x)), np.empty(len(x)), np.empty(len(x)), np.empty(len(x))
    for n in range(len(inputs)):
        if n % every == 0:
            states[n // every] = x
        t, u[0] = n * step, inputs[n]
        rate(x, t, u, p, k1)
        rate(x + 0.5 * step * k1, t + 0.5 * step, u, p, k2)
        rate(x + 0.5 * step * k2, t + 0.5 * step, u, p, k3)
        rate(x + step * k3, t + step, u, p, k4)
        x = x + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return states


def _late(given: NDArray, every: int, delay: float, deviation: float) -> NDArray:
    """Mean command in each step of the truth; the other law spreads the delay [sampling periods]."""
    edges, before = np.arange(len(given) * every + 1) / every, float(len(given))
    grid = [-before, *range(len(given) + 1)]
    total = np.array([-before * given[0], 0.0, *np.cumsum(given)])

    def acting(by: float) -> NDArray:
        return every * np.diff(np.interp(edges - by, grid, total))

    return law(acting(delay), 0.5 * (acting(0.5 * delay) + acting(1.5 * delay)), deviation)


def _drawn_unit(system: System, rng: Generator) -> dict[str, Any]:
    """True values of one unit: calibrated parameters, tolerances, and offsets of its runs [SI]."""
    own = {p.symbol: p.nominal * rng.uniform(0.9, 1.1) for p in system.parameters}
    own |= {t.symbol: rng.normal(t.centre, t.sd) for t in system.tolerances}
    return own | {o.symbol: rng.normal(o.centre, o.sd, len(HELD_OUT)) for o in system.run_offsets}


def _size(
    plant: str,
    unit: Values,
    symbol: str,
    deviation: float,
    commands: Sequence[NDArray],
    rng: Generator,
    effect: float,
) -> float:
    """Size [SI] whose effect after recalibration, rms, is `effect` [noise deviations]: bisection."""
    system = SYSTEMS[plant]
    noise = np.array([channel.known_noise for channel in system.channels])[:, None]
    own = {c.name: c.parameters[0] for c in system.causes}.get(symbol)
    largest = INSIDE * own.high if own else system.strangers[symbol]
    sign = rng.choice([-1.0, 1.0]) if own and own.low < 0.0 else 1.0

    def read(changed: Values) -> NDArray:
        exact = true_readings(plant, {**unit, **changed}, deviation, commands, finer=1)
        return np.concatenate([(run / noise).ravel() for run in exact])

    base = read({})
    steps = {p.symbol: unit[p.symbol] * 1.001 for p in system.parameters}
    slopes = np.linalg.qr(np.stack([read({s: v}) - base for s, v in steps.items()], axis=1))[0]
    low, high = np.log(largest / 3000.0), np.log(largest)
    for _ in range(7):
        middle = 0.5 * (low + high)
        change = read({symbol: sign * np.exp(middle)}) - base
        left = change - slopes @ (slopes.T @ change)
        low, high = (low, middle) if np.sqrt(np.mean(left**2)) > effect else (middle, high)
    return float(sign * np.exp(high))


def _measured(
    system: System, rng: Generator, exact: Sequence[NDArray]
) -> tuple[list[Channel], list[NDArray]]:
    """Channels as stated, and readings of each run (channels, samples) [SI].

    Some trials have coarse readings, and a slow drift or a ripple in one channel. The noise is stated
    right, wrong by up to a factor of 2, or not at all; the step of coarse readings every second time.
    """
    factor = rng.choice([1.0, 2.0 ** rng.uniform(-1.0, 1.0), 0.0], p=[0.5, 0.3, 0.2])
    coarse, drifting, rippled = rng.random(3) < (0.25, 0.2, 0.15)
    step, told = rng.uniform(1.0, 4.0), rng.random() < 0.5  # [noise deviations]
    disturbed = rng.integers(len(system.channels))
    waves = (  # size [noise deviations], periods in a sample
        (rng.uniform(1.0, 3.0) * drifting, rng.uniform(0.3, 1.5) / SAMPLES),
        (rng.uniform(0.5, 2.0) * rippled, rng.uniform(0.05, 0.3)),
    )
    noise = np.array([channel.known_noise for channel in system.channels])[:, None]
    measured = []
    for run in exact:
        read = run / noise + rng.standard_normal(run.shape)
        for size, frequency in waves:
            read[disturbed] += size * np.sin(
                2.0 * np.pi * (frequency * np.arange(SAMPLES) + rng.random())
            )
        measured.append(noise * (step * np.round(read / step) if coarse else read))
    stated = [
        replace(
            channel,
            noise=float(factor * channel.known_noise) or None,
            resolution=float(step * channel.known_noise) if coarse and told else 0.0,
        )
        for channel in system.channels
    ]
    return stated, measured
