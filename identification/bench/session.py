"""A session on the virtual bench: true trajectories, and what the sensors make of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.common.results_folder import progress
from epv_env.plant.channels import SENSORS, Sensor, readings
from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised, simulate
from identification.bench.programmes import Programme
from identification.recordings.columns import LEAST_RATE
from identification.recordings.recording import (
    CHANNELS,
    RULES,
    UNITS,
    Campaign,
    Recording,
    RecordingRules,
)
from identification.report_2003 import SAMPLING_RATE

GREATEST_RATE = 20_000.0
"""Greatest sampling rate [1/s]."""

RESERVOIR_VOLUME = 0.08
"""The bench's two reservoirs of 40 litres (section 3) [m^3]; air drawn from them lowers p1."""


@dataclass(frozen=True, kw_only=True)
class TrueSignals:
    """What really happened in one recording."""

    programme: Programme
    period: float
    """Time between samples [s]."""
    channels: Mapping[str, NDArray]
    """By name as recording.CHANNELS, each (samples,) [SI]."""


def run_programme(
    parameters: Parameters,
    programme: Programme,
    *,
    rate: float = SAMPLING_RATE,
    reservoir: float = RESERVOIR_VOLUME,
) -> TrueSignals:
    """The true signals of one recording.

    rate: samples per second [1/s]. reservoir: volume that feeds p1 [m^3]. Raises SimulationError for a
    valve that cannot be integrated.
    """
    U = programme.case.voltage(programme.U_on, rate)
    start = initial_state(parameters, programme)
    # Switching takes effect at the sample at which the voltage is first read, or later.
    run = simulate(parameters, initial=start, U=U, period=1.0 / rate, reservoir_volume=reservoir)
    channels = {"U": U, **readings(run.state, parameters)}
    return TrueSignals(programme=programme, period=1.0 / rate, channels=channels)


def measured_recording(
    truth: TrueSignals,
    rng: np.random.Generator,
    offsets: Mapping[str, float] | None = None,
    sensors: Mapping[str, Sensor] = SENSORS,
) -> Recording:
    """A recording of the truth by the sensors of Tables 1 to 3: offset, trend, noise, 12 bit.

    offsets: by channel [bar, A, V], a channel that is left out has none; None: the sensors' own.
    sensors: of the bench, by channel [bar absolute, A or V].
    """
    if offsets is None:
        offsets = {name: sensor.offset for name, sensor in sensors.items()}
    readings = {}
    for channel in CHANNELS:
        value = truth.channels[channel] / UNITS[channel][1]
        time = np.arange(len(value)) * truth.period
        drifted = value + offsets.get(channel, 0.0) + sensors[channel].trend * time
        reading = sensors[channel].measure(drifted, rng.standard_normal(len(value)))
        readings[channel] = reading * UNITS[channel][1]
    return Recording(
        name=truth.programme.name,
        role=truth.programme.role,
        period=truth.period,
        sigma_S=np.zeros_like(truth.channels["U"]),
        **readings,
    )


def measured_campaign(
    truths: Sequence[TrueSignals],
    parameters: Parameters,
    *,
    seed: int,
    name: str = "virtual bench",
    offsets: Mapping[str, float] | None = None,
    rules: RecordingRules = RULES,
) -> Campaign:
    """A campaign of the truths; each recording's noise has a generator of its own, from the seed.

    rules: by which the recordings are read, with the bench's sensors.
    """
    generators = [np.random.default_rng([seed, index]) for index in range(len(truths))]
    return Campaign(
        name=name,
        temperature=parameters["T_env"],
        pressure=parameters["p_env"],
        rules=rules,
        recordings=tuple(
            measured_recording(t, rng, offsets, rules.sensors)
            for t, rng in zip(truths, generators, strict=True)
        ),
    )


def initial_state(parameters: Parameters, programme: Programme) -> State:
    """Steady state in which a recording begins; without voltage every chamber is at ambient pressure."""
    if programme.U_on == 0:
        rest = energised(parameters, p1=parameters["p_env"], p2=parameters["p_env"], U=0.0)
        return rest._replace(xMV=0.0)
    return energised(parameters, p1=programme.p1, p2=programme.p2, U=programme.U_on)


def run_bench(
    suite: Sequence[Programme],
    truth: Parameters,
    *,
    seed: int,
    rate: float = SAMPLING_RATE,
    rules: RecordingRules = RULES,
) -> Campaign:
    """Run and measure every programme on a plant with the true parameters.

    rate: samples per second [1/s]. seed: of the sensors' noise. rules: by which the recordings are read,
    with the bench's sensors. Raises ValueError for a rate that the
    bench does not have.
    """
    least, greatest = LEAST_RATE, GREATEST_RATE
    if not least <= rate <= greatest:
        raise ValueError(
            f"sampling rate {rate:g} 1/s is outside {least:g} to {greatest:g}: choose one inside"
        )
    truths = [
        run_programme(truth, programme, rate=rate)
        for programme in progress(suite, what="bench: recordings", total=len(suite))
    ]
    return measured_campaign(truths, truth, seed=seed, rules=rules)
