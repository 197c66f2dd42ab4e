"""Twin campaigns: the virtual bench with Table 12's plant as the truth, made once for all tests."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from epv_env.plant.channels import SENSORS
from epv_env.plant.free_parameters import Freedom
from epv_env.plant.parameters import Parameters
from identification.bench.programmes import DIAGNOSIS_SUITE, REPORT_SUITE
from identification.bench.session import TrueSignals, measured_campaign, run_programme
from identification.calibration.calibrate import Calibration, calibrate
from identification.calibration.problem import CalibrationProblem, calibration_problem
from identification.confidence import Confidence, assess_confidence
from identification.recordings.recording import CHANNELS, UNITS, Campaign, Recording

TRUE = Parameters.calibrated()
PROGRAMMES = {programme.name: programme for programme in DIAGNOSIS_SUITE}
REPORT = tuple(programme.name for programme in REPORT_SUITE)
SWITCHING = tuple(name for name in REPORT if name != "rest")


@cache
def truth(name: str, rate: float = 2000.0) -> TrueSignals:
    """What really happened in one recording of the diagnosis suite."""
    return run_programme(TRUE, PROGRAMMES[name], rate=rate)


@cache
def twin(seed: int = 1, rate: float = 2000.0) -> Campaign:
    """The report's suite, measured."""
    return measured_campaign([truth(name, rate) for name in REPORT], TRUE, seed=seed)


@cache
def problem(seed: int = 1) -> CalibrationProblem:
    """What the measured suite poses, from Table 10."""
    return calibration_problem(twin(seed))


@cache
def calibration() -> Calibration:
    """The measured suite, calibrated from Table 10 alone."""
    with TemporaryDirectory() as folder:
        return calibrate(problem(), journal=Path(folder) / "journal.jsonl", subject={}, starts=1)


def exact_recording(name: str, rate: float = 2000.0, share: float = 1e-6, seed: int = 0) -> Recording:
    """A truth seen by sensors without offset, trend and steps, and with a share of their noise."""
    rng = np.random.default_rng(seed)
    true = truth(name, rate)
    readings: dict[str, Any] = {
        channel: true.channels[channel]
        + share
        * SENSORS[channel].noise
        * UNITS[channel][1]
        * rng.standard_normal(len(true.channels["U"]))
        for channel in CHANNELS
    }
    still = np.zeros_like(true.channels["U"])
    role = true.programme.role
    return Recording(name=name, role=role, period=true.period, sigma_S=still, **readings)


@cache
def exact_problem() -> CalibrationProblem:
    """The report's switching recordings almost free of noise, from Table 10."""
    recordings = tuple(exact_recording(name) for name in SWITCHING)
    campaign = Campaign(name="exact", temperature=293.0, pressure=1e5, recordings=recordings)
    return calibration_problem(campaign)


def freed(*symbols: str) -> dict[str, Freedom]:
    """These parameters may move within their domains, and nothing is known of them before."""
    return dict.fromkeys(symbols, Freedom())


@cache
def twin_confidence() -> Confidence:
    """The confidence stage on that calibration."""
    return assess_confidence(calibration())
