"""Twin campaigns: the virtual bench with Table 12's plant as the truth, made once for all tests."""

from functools import cache

import numpy as np

from epv_env.plant.parameters import Parameters
from epv_env.plant.sensors import SENSORS
from identification.bench.campaign import Truth, measured, measured_campaign, run_programme
from identification.bench.programmes import REPORT_SUITE, Programme
from identification.calibration.fits import nelder_mead, weighted_least_squares
from identification.calibration.problem import Problem, calibration_problem
from identification.recordings.recording import CHANNELS, UNITS, Campaign, Recording

TRUE = Parameters.calibrated()
PROGRAMMES = {programme.name: programme for programme in REPORT_SUITE}


@cache
def truth(name: str, rate: float = 2000.0) -> Truth:
    """One recording of the report's suite as it really happened."""
    return run_programme(TRUE, PROGRAMMES[name], rate=rate)


@cache
def twin(seed: int = 1, rate: float = 2000.0) -> Campaign:
    """The report's suite, measured."""
    return measured_campaign([truth(name, rate) for name in PROGRAMMES], TRUE, seed=seed)


@cache
def problem(seed: int = 1) -> Problem:
    """What the measured suite poses, from Table 10."""
    return calibration_problem(twin(seed))


def exact_recording(truth: Truth, share: float = 1e-6, seed: int = 0) -> Recording:
    """A truth as sensors without offset, trend and steps would show it, with a share of their noise."""
    rng = np.random.default_rng(seed)
    readings = {
        name: truth.channels[name]
        + share * SENSORS[name].noise * UNITS[name][1] * rng.standard_normal(len(truth.channels[name]))
        for name in CHANNELS
    }
    programme, still = truth.programme, np.zeros_like(truth.channels["U"])
    return Recording(
        name=programme.name, role=programme.role, period=truth.period, sigma_S=still, **readings
    )


@cache
def exact_campaign() -> Campaign:
    """The report's switching recordings almost free of noise."""
    recordings = [exact_recording(truth(name)) for name in PROGRAMMES if name != "rest"]
    return Campaign(name="exact", temperature=293.0, pressure=1e5, recordings=tuple(recordings))
