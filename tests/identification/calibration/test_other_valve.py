"""A valve of half the size, described by a plant file: its truth comes back as the report's does."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from epv_env.plant.plantfile import Plant, load_plant
from identification.bench.programmes import REPORT_SUITE, at_voltage
from identification.bench.session import measured_campaign, run_programme
from identification.calibration.problem import CalibrationProblem, calibration_problem
from identification.calibration.search import weighted_least_squares
from identification.confidence import estimate_covariance
from identification.pipeline import identification
from identification.recordings.recording import Campaign, rules_of

HALF_SIZE = Path(__file__).parents[3] / "docs/examples/half_size/half-size.json"
TRUE_VALUES = {"alphaMV": 0.66, "alphaPV": 0.33, "RML": 3.2e7, "R": 12.4}
NINETY_NINE_PERCENT = 13.3
"""Of chi-square with four degrees of freedom."""


@cache
def plant() -> Plant:
    return load_plant(HALF_SIZE)


@cache
def problem() -> CalibrationProblem:
    """What its virtual bench's recordings pose, from the data sheet's values."""
    truth, rules = plant().parameters.replace(**TRUE_VALUES), rules_of(plant())
    suite = at_voltage(REPORT_SUITE, plant().voltage)
    truths = [run_programme(truth, programme) for programme in suite]
    campaign = measured_campaign(truths, truth, seed=2, rules=rules)
    return calibration_problem(campaign, start=plant().parameters, free=plant().free)


@cache
def estimate():
    """The scaled estimate (k,) and its covariance (k, k)."""
    fit = weighted_least_squares(problem(), problem().vector.scaled(problem().vector.reference))
    assert fit.converged
    return fit.z, estimate_covariance(problem(), fit.z)[0]


def test_its_truth_lies_in_the_joint_region_of_its_estimate():
    z, covariance = estimate()
    true = problem().vector.reference.replace(**TRUE_VALUES)
    apart = z - problem().vector.scaled(true)
    assert apart @ np.linalg.solve(covariance, apart) < NINETY_NINE_PERCENT


def test_its_data_sheet_does_not():
    z, covariance = estimate()
    apart = z - problem().vector.scaled(problem().vector.reference)
    assert apart @ np.linalg.solve(covariance, apart) > 100 * NINETY_NINE_PERCENT


def test_finished_searches_belong_to_the_whole_plant(monkeypatch):
    """Not only to the parameters that the searches begin with."""
    subjects = []
    monkeypatch.setattr(identification, "calibration_problem", lambda *_, **__: None)
    monkeypatch.setattr(
        identification, "calibrate", lambda _, **given: subjects.append(given["subject"])
    )
    nothing = Campaign(name="", temperature=293.0, pressure=1e5, recordings=())
    for voltage in (24.0, 24.0, 18.0):
        valve = replace(plant(), voltage=voltage)
        assert identification.Identification(nothing, Path("journal"), plant=valve).calibration is None
    assert subjects[0] == subjects[1]
    assert subjects[0] != subjects[2]
