"""What the recordings leave open of a fit's numbers."""

from dataclasses import replace

import numpy as np
import pytest

from identification.gap.fit.evidence import _covariance
from identification.gap.fit.variable_projection import LinearisedRun, normal_equations

ALONG = np.array([1.0, 1.0])


def test_what_no_reading_tells_is_wide_but_known_to_be():
    """A hessian that rounding has made indefinite still gives variances."""
    hessian = 1e8 * np.outer(ALONG, ALONG) - 1e-7 * np.eye(2)
    assert np.min(np.linalg.eigvalsh(hessian)) <= 0
    none = np.zeros((3, 0))
    run = LinearisedRun(
        residual=np.zeros(3), slopes=np.eye(3)[:, :2], slope_precision=np.zeros(2),
        slope_values=np.zeros(2), run_slopes=none, run_values=np.zeros(0), run_sd=np.zeros(0),
        shared_slopes=none,
    )  # fmt: skip
    equations = replace(normal_equations([run]), hessian=hessian)
    found = _covariance(equations)
    assert np.all(np.diag(found) > 1.0)
    assert ALONG @ found @ ALONG == pytest.approx(1e-8, rel=1e-3)
