"""What the recordings leave open of a fit's numbers."""

import numpy as np
import pytest

from identification.gap.fit.variable_projection import Normal
from identification.gap.rank.evidence import _covariance


def test_what_no_reading_tells_is_wide_but_known_to_be():
    """A hessian that rounding has made indefinite still gives variances."""
    along = np.array([1.0, 1.0])
    hessian = 1e8 * np.outer(along, along) - 1e-7 * np.eye(2)
    assert np.min(np.linalg.eigvalsh(hessian)) <= 0
    normal = Normal(
        gram=np.zeros((3, 3)), hessian=hessian, gradient=np.zeros(2), least=0.0, chi_square=0.0,
        shared=np.zeros(0),
    )  # fmt: skip
    found = _covariance(normal)
    assert np.all(np.diag(found) > 1.0)
    assert along @ found @ along == pytest.approx(1e-8, rel=1e-3)
