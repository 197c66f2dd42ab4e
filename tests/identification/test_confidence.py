"""Covariance, intervals and joint region: other campaigns, and a model that is wrong."""

from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from identification.calibration.problem import calibration_problem
from identification.calibration.search import METHODS, TotalError, weighted_least_squares
from identification.confidence import assess_confidence, confidence_section
from tests.identification.twins import TRUE, calibration, freed, problem, twin, twin_confidence


def test_what_the_model_lacks_widens_the_covariance():
    """Table 10's other three values do not explain the recordings."""
    posed = calibration_problem(twin(), free=freed("alphaMV"))
    fit = weighted_least_squares(posed, np.ones(1))
    wide = assess_confidence(replace(calibration(), problem=posed, fits={m: [fit] for m in METHODS}))
    assert twin_confidence().widening < 1.1 < 10 < wide.widening


def test_estimates_of_other_campaigns_scatter_as_it_says():
    """Squared distances of eight campaigns follow chi-square, and no covariance of another size."""
    distances = []
    for seed in range(2, 10):
        twin = problem(seed)
        fit = weighted_least_squares(twin, twin.vector.scaled(TRUE))
        apart = fit.z - twin.vector.scaled(TRUE)
        distances.append(apart @ np.linalg.solve(twin_confidence().covariance, apart))
    low, high = chi2.ppf([0.001, 0.999], 4 * len(distances))
    assert low < np.sum(distances) < high
    assert not low < 4 * np.sum(distances) < high
    assert not low < np.sum(distances) / 4 < high


def displaced(factors):
    """The stage on a Nelder-Mead estimate that lies elsewhere."""
    fit = calibration().best("Nelder-Mead")
    z = fit.z * np.array(factors)
    moved = replace(fit, z=z, error=TotalError(problem())(z))
    return assess_confidence(replace(calibration(), fits={**calibration().fits, "Nelder-Mead": [moved]}))


def verdicts(confidence):
    return [verdict.status for verdict in confidence_section(confidence).verdicts]


def squared_distance(vector) -> float:
    """From the estimate, by its covariance."""
    apart = vector - twin_confidence().estimate
    return float(apart @ np.linalg.solve(twin_confidence().covariance, apart))


def test_the_truth_lies_in_the_joint_region_and_in_every_interval_and_half_a_percent_off_does_not():
    true = problem().vector.scaled(TRUE)
    assert squared_distance(true) < twin_confidence().chi_square
    assert squared_distance(1.005 * true) > 10 * twin_confidence().chi_square
    for symbol, (low, high) in twin_confidence().intervals().items():
        assert low < TRUE[symbol] < high


def test_the_two_methods_estimates_are_told_apart():
    """1 % more R is far outside the region."""
    assert verdicts(twin_confidence()) == ["good", "good"]
    away = displaced([1.0, 1.0, 1.0, 1.01])
    assert away.disagreement > away.chi_square
    assert verdicts(away) == ["good", "doubt"]
