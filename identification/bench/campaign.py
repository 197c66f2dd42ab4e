"""The bench at work: a plant's true trajectories, and what the sensors make of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.channels import MEASURED_CHANNELS
from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters
from epv_env.plant.readings import readings
from epv_env.plant.sensors import SENSORS
from epv_env.plant.simulate import energised
from identification.bench.automaton import simulate_reference
from identification.bench.programmes import Programme
from identification.bench.schedule import delayed_schedule, scheduled
from identification.recordings.recording import CHANNELS, UNITS, Campaign, Recording
from identification.report_2003.cases import RATE

RESERVOIR = 0.08
"""The bench's two reservoirs of 40 litres (section 3) [m^3]; air drawn from them lowers p1."""

RTOL = 1e-8
"""Relative tolerance of the bench's solver: errors below 0.1 mbar, a thirtieth of an ADC step."""

OFFSETS = {channel.name: channel.sensor.offset for channel in MEASURED_CHANNELS}
"""Reading less truth at the start of a recording (Table 2; pressures less 1 bar) [bar, A, V]."""

TRENDS = {channel.name: channel.sensor.trend for channel in MEASURED_CHANNELS}
"""Drift of the readings (Table 2) [bar/s, A/s, V/s]."""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What really happened in one recording; arrays (samples,) by channel, SI units."""

    programme: Programme
    period: float
    channels: Mapping[str, NDArray]


def run_programme(
    parameters: Parameters, programme: Programme, *, rate: float = RATE, reservoir: float = RESERVOIR
) -> Truth:
    """The true course of one recording at `rate` samples per second."""
    U = programme.case.voltage(programme.U_on, rate)
    time = np.arange(len(U)) / rate
    start = initial_state(parameters, programme)
    # Switching takes effect at the sample at which the voltage is first read, or later.
    schedule = scheduled(parameters, start, time, U=U[:-1], reservoir_volume=reservoir)
    delayed = delayed_schedule(schedule, parameters["t_delay"])
    state = simulate_reference(delayed, time, rtol=RTOL).state
    channels = {"U": U, **readings(state, parameters)}
    return Truth(programme=programme, period=1.0 / rate, channels=channels)


def measured(
    truth: Truth, rng: np.random.Generator, offsets: Mapping[str, float] = OFFSETS
) -> Recording:
    """A recording of the truth by the sensors of Tables 1 to 3: offset, trend, noise, 12 bit.

    offsets: by channel, as OFFSETS; a channel that is left out has none.
    """
    readings = {}
    for channel in CHANNELS:
        value = truth.channels[channel] / UNITS[channel][1]
        time = np.arange(len(value)) * truth.period
        drifted = value + offsets.get(channel, 0.0) + TRENDS[channel] * time
        reading = SENSORS[channel].measure(drifted, rng.standard_normal(len(value)))
        readings[channel] = reading * UNITS[channel][1]
    return Recording(
        name=truth.programme.name,
        role=truth.programme.role,
        period=truth.period,
        sigma_S=np.zeros_like(truth.channels["U"]),
        **readings,
    )


def measured_campaign(
    truths: Sequence[Truth],
    parameters: Parameters,
    *,
    seed: int,
    name: str = "virtual bench",
    offsets: Mapping[str, float] = OFFSETS,
) -> Campaign:
    """A campaign of the truths; each recording's noise has a generator of its own, from the seed."""
    generators = [np.random.default_rng([seed, index]) for index in range(len(truths))]
    return Campaign(
        name=name,
        temperature=parameters["T_env"],
        pressure=parameters["p_env"],
        recordings=tuple(measured(t, rng, offsets) for t, rng in zip(truths, generators, strict=True)),
    )


def initial_state(parameters: Parameters, programme: Programme) -> State:
    """Steady state in which a recording begins; without voltage every chamber is at ambient pressure."""
    if programme.U_on == 0:
        rest = energised(parameters, p1=parameters["p_env"], p2=parameters["p_env"], U=0.0)
        return rest._replace(xMV=0.0)
    return energised(parameters, p1=programme.p1, p2=programme.p2, U=programme.U_on)
