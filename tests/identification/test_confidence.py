"""Covariance, intervals and joint region: known inflation, other campaigns, closed forms of eq. 23."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2, t

from identification.calibration.search import weighted_least_squares
from identification.confidence import covariance as stage
from identification.confidence.confidence import assess_confidence, confidence_section, limit_ratio
from identification.confidence.covariance import estimate_covariance
from tests.identification.twins import TRUE, calibration, problem, twin_confidence

SAMPLES, RECORDINGS = 4000, 3
SLOPES = (1.0, 0.5, 2.0)
"""Derivatives of p2, p3 and I by the first parameter, constant in time; the second moves p3 alone."""


class Synthetic:
    """A misfit with residuals (RECORDINGS, 3, SAMPLES) and derivatives that do not change in time."""

    def __init__(self, residuals):
        ones, still = np.ones(SAMPLES), np.zeros(SAMPLES)
        first = np.concatenate([slope * ones for slope in SLOPES])
        second = np.concatenate([still, ones, still])
        self.jacobian = np.stack([first, second], axis=1)
        self.residuals = residuals.reshape(RECORDINGS, -1)

    def linearised(self, z):
        return list(self.residuals), [self.jacobian] * RECORDINGS


def coloured(phi, seed=0):
    """Residuals e(k) = phi e(k - 1) + white of variance 1, each output and recording of its own."""
    white = np.random.default_rng(seed).standard_normal((RECORDINGS, len(SLOPES), SAMPLES + 500))
    return Synthetic(np.sqrt(1 - phi**2) * np.asarray(lfilter([1.0], [1.0, -phi], white))[..., 500:])


@pytest.fixture
def covariance_of(monkeypatch):
    """The covariance of a synthetic misfit, whose inputs are exact."""
    for share in ("_input_share", "_offset_share"):
        monkeypatch.setattr(stage, share, lambda *arguments: np.zeros((2, 2)))
    return lambda misfit: estimate_covariance(problem(), misfit, np.ones(2))


def known(misfit, phi):
    """H M H with the variance (1 + phi) / (1 - phi) of every output's sum over time."""
    J = misfit.jacobian
    return np.linalg.inv(RECORDINGS * J.T @ J) * (1 + phi) / (1 - phi)


def test_white_residuals_are_independent(covariance_of):
    both = covariance_of(coloured(0.0))
    np.testing.assert_allclose(both.independent, known(coloured(0.0), 0.0), rtol=0.05)
    np.testing.assert_allclose(np.diag(both.residual), np.diag(both.independent), rtol=0.15)


@pytest.mark.parametrize("phi", [0.8, -0.4])
def test_the_sandwich_knows_what_neighbours_have_in_common(covariance_of, phi):
    misfit = coloured(phi)
    ratio = np.diag(covariance_of(misfit).residual) / np.diag(known(misfit, phi))
    np.testing.assert_allclose(ratio, 1.0, atol=0.25)
    independent = np.diag(covariance_of(misfit).independent) / np.diag(known(misfit, phi))
    np.testing.assert_allclose(independent, (1 - phi) / (1 + phi), rtol=0.1)


def test_the_noise_of_the_inputs_adds_with_its_square(monkeypatch):
    """U's and p1's, without the record at rest; none, none."""
    monkeypatch.setattr(stage, "INPUT_DRAWS", 2)
    shares = {}
    for size in (0.0, 1.0, 2.0):
        noise = {n: v * (size if n in ("U", "p1") else 1.0) for n, v in problem().noise.items()}
        quiet = replace(problem(), noise=noise, offsets={})
        shares[size] = estimate_covariance(
            quiet, problem().least_squares(), twin_confidence().estimate
        ).inputs
    assert np.all(np.diag(shares[0.0]) < 1e-3 * np.diag(shares[1.0]))
    np.testing.assert_allclose(np.diag(shares[2.0]), 4 * np.diag(shares[1.0]), rtol=0.02)


def test_offsets_that_are_known_badly_widen_the_covariance():
    offsets = {n: replace(o, error=100 * o.error) for n, o in problem().offsets.items()}
    unsure = replace(problem(), offsets=offsets)
    wide = estimate_covariance(unsure, problem().least_squares(), twin_confidence().estimate)
    assert np.all(np.diag(wide.inputs) > 3 * np.diag(twin_confidence().covariance.inputs))
    np.testing.assert_allclose(wide.residual, twin_confidence().covariance.residual)


def test_estimates_of_other_campaigns_scatter_as_it_says():
    """Squared distances of eight campaigns follow chi-square, and no covariance of another size."""
    distances = []
    for seed in range(2, 10):
        twin = problem(seed)
        fit = weighted_least_squares(twin.least_squares(), twin.vector.scaled(TRUE))
        apart = fit.z - twin.vector.scaled(TRUE)
        distances.append(apart @ np.linalg.solve(twin_confidence().covariance.total, apart))
    low, high = chi2.ppf([0.001, 0.999], 4 * len(distances))
    assert low < np.sum(distances) < high
    assert not low < 4 * np.sum(distances) < high
    assert not low < np.sum(distances) / 4 < high


def displaced(factors):
    """The stage on a Nelder-Mead estimate that lies elsewhere."""
    fit = calibration().best("Nelder-Mead")
    z = fit.z * np.array(factors)
    moved = replace(fit, z=z, error=problem().total_error().error(z))
    return assess_confidence(replace(calibration(), fits={**calibration().fits, "Nelder-Mead": [moved]}))


def verdicts(confidence):
    return [verdict.status for verdict in confidence_section(confidence).verdicts]


def squared_distance(vector) -> float:
    """From the estimate, by its covariance."""
    apart = vector - twin_confidence().estimate
    return float(apart @ np.linalg.solve(twin_confidence().covariance.total, apart))


def test_the_truth_lies_in_the_joint_region_and_in_every_interval_and_half_a_percent_off_does_not():
    true = problem().vector.scaled(TRUE)
    assert squared_distance(true) < twin_confidence().chi_square
    assert squared_distance(1.005 * true) > 10 * twin_confidence().chi_square
    for symbol, (low, high) in twin_confidence().intervals().items():
        assert low < TRUE[symbol] < high


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


@pytest.mark.parametrize("degrees", [5, 50, 18000])
def test_two_parameters_have_a_closed_form(degrees):
    """The quantile of F(2, n) is n/2 ((1 - p)^(-2/n) - 1), so the ratio is (1 - p)^(-2/n)."""
    assert limit_ratio(degrees + 2, 2) == pytest.approx(0.05 ** (-2 / degrees), rel=1e-9)


def test_one_parameter_has_student_s_quantile():
    assert limit_ratio(31, 1) == pytest.approx(1 + t.ppf(0.975, 30) ** 2 / 30, rel=1e-9)


@pytest.mark.parametrize("symbol", ["alphaMV", "R"])
def test_at_the_ends_of_an_interval_the_total_error_is_the_limit(symbol):
    """One parameter moved, the others held: the error's rise is eps_p - eps_opt within 2 %."""
    error, report = problem().total_error().error, twin_confidence().report
    at = twin_confidence().problem.vector.symbols.index(symbol)
    rise = report.error * (report.ratio - 1)
    for way in (-1, 1):
        moved = twin_confidence().nelder_mead.copy()
        moved[at] += way * report.half_widths[at]
        assert error(moved) - report.error == pytest.approx(rise, rel=0.02)
        moved[at] += way * report.half_widths[at]
        assert error(moved) - report.error > 3 * rise


def test_the_joint_limit_is_met_along_any_direction():
    report, error = twin_confidence().report, problem().total_error().error
    direction = np.array([1.0, -2.0, 0.5, 1.0]) * report.half_widths
    rise = direction @ report.curvature @ direction
    edge = direction * np.sqrt(report.squared_rise / rise)
    assert report.holds_jointly(0.999 * edge)
    assert not report.holds_jointly(1.001 * edge)
    limit = report.error * report.ratio
    assert error(twin_confidence().nelder_mead + edge) - report.error == pytest.approx(
        limit - report.error, rel=0.02
    )
