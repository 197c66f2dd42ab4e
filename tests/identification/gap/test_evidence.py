"""What the recordings leave open of a fit's numbers."""

import numpy as np
import pytest

from identification.gap.fit.variable_projection import NormalEquations
from identification.gap.rank.evidence import _covariance
from identification.gap.rank.settings import RankingSettings


def test_what_no_reading_tells_is_wide_but_known_to_be():
    """A hessian that rounding has made indefinite still gives variances."""
    along = np.array([1.0, 1.0])
    hessian = 1e8 * np.outer(along, along) - 1e-7 * np.eye(2)
    assert np.min(np.linalg.eigvalsh(hessian)) <= 0
    equations = NormalEquations(
        gram=np.zeros((3, 3)), hessian=hessian, gradient=np.zeros(2), least=0.0, chi_square=0.0,
        tolerances=np.zeros(0), largest_deviation=3.0,
    )  # fmt: skip
    found = _covariance(equations, RankingSettings().smallest_eigenvalue)
    assert np.all(np.diag(found) > 1.0)
    assert along @ found @ along == pytest.approx(1e-8, rel=1e-3)
