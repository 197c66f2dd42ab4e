"""A campaign that keeps every rule: short recordings of the calibrated plant with the bench's noise."""

from functools import cache

import numpy as np

from epv_env.plant.channels import SENSORS, readings
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised, simulate
from identification.recordings.recording import CHANNELS, UNITS, Campaign, Recording
from identification.report_2003 import CALIBRATION_CASES, SAMPLING_RATE


@cache
def switching(role: str = "calibration", rate: float = SAMPLING_RATE, name: str = "test1") -> Recording:
    """The report's Test1 (0.65 s), measured."""
    p = Parameters.calibrated()
    U = CALIBRATION_CASES[0].voltage(24.0, rate)
    start = energised(p, p1=12e5, p2=6.8e5, U=24.0)
    state = simulate(p, initial=start, U=U, period=1 / rate).state
    return _measured(name, role, rate, {"U": U, **readings(state, p)})


@cache
def resting(name: str = "rest") -> Recording:
    """Half a second with the coil off and every chamber vented, measured."""
    p = Parameters.calibrated()
    vented = readings(energised(p, p1=1e5, p2=1e5, U=0.0), p)
    count = round(0.5 * SAMPLING_RATE)
    truth = {channel: np.full(count, value) for channel, value in {"U": 0.0, **vented}.items()}
    return _measured(name, "quality", SAMPLING_RATE, truth)


@cache
def good_campaign() -> Campaign:
    """One recording of every role."""
    recordings = (switching(), switching("validation", name="validation"), resting())
    return campaign_of(*recordings)


def campaign_of(*recordings: Recording) -> Campaign:
    """A campaign of these recordings at 20 degrees Celsius and 1 bar."""
    return Campaign(name="bench run", temperature=293.0, pressure=1e5, recordings=recordings)


def _measured(name: str, role: str, rate: float, truth: dict) -> Recording:
    rng = np.random.default_rng(1)
    measured = {}
    for channel in CHANNELS:
        unit = UNITS[channel][1]
        value = truth[channel] / unit
        measured[channel] = SENSORS[channel].measure(value, rng.standard_normal(len(value))) * unit
    zero = np.zeros(len(truth["U"]))
    return Recording(name=name, role=role, period=1 / rate, sigma_S=zero, **measured)
