"""Intervals, the joint region of the plant file, and the check of the minimum."""

from dataclasses import replace

import numpy as np

from identification.confidence.confidence import assess_confidence, confidence_section
from tests.identification.confidence.results import twin_confidence
from tests.identification.twins import TRUE, calibration, problem


def displaced(factors):
    """The stage on a Nelder-Mead estimate that lies elsewhere."""
    fit = calibration().best("Nelder-Mead")
    z = fit.z * np.array(factors)
    moved = replace(fit, z=z, error=problem().total_error().error(z))
    return assess_confidence(replace(calibration(), fits={**calibration().fits, "Nelder-Mead": [moved]}))


def verdicts(confidence):
    return [verdict.status for verdict in confidence_section(confidence).verdicts]


def test_the_truth_lies_in_the_joint_region_and_in_every_interval():
    apart = problem().vector.scaled(TRUE) - twin_confidence().estimate
    assert (
        apart @ np.linalg.solve(twin_confidence().covariance.total, apart) < twin_confidence().chi_square
    )
    for symbol, (low, high) in twin_confidence().intervals().items():
        assert low < TRUE[symbol] < high


def test_a_truth_that_is_half_a_percent_off_would_not():
    apart = 1.005 * problem().vector.scaled(TRUE) - twin_confidence().estimate
    assert (
        apart @ np.linalg.solve(twin_confidence().covariance.total, apart)
        > 10 * twin_confidence().chi_square
    )


def test_at_the_estimate_the_gradient_is_zero_and_the_hessian_positive():
    minimum = twin_confidence().minimum
    assert np.all(minimum.eigenvalues > 0.1)
    assert np.max(np.abs(minimum.gradient)) < 1e-4
    assert verdicts(twin_confidence()) == ["good", "good", "good"]


def test_beside_it_the_gradient_is_not_zero():
    """1 % more R; the two methods' estimates are told apart as well."""
    away = displaced([1.0, 1.0, 1.0, 1.01])
    assert np.max(np.abs(away.minimum.gradient)) > 0.1
    assert away.disagreement > away.chi_square
    assert verdicts(away) == ["good", "doubt", "doubt"]
