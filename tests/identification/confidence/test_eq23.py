"""Eq. 23 against closed forms, and its intervals against the total error itself."""

import numpy as np
import pytest
from scipy.stats import t

from identification.confidence.confidence import limit_ratio
from tests.identification.twins import problem, twin_confidence


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
