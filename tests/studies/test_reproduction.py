"""The page of the report's tables shows what is computed."""

import json

import numpy as np
import pytest

from docs.studies.reproduction.study import (
    FOLDER,
    agreement,
    differences,
    limit_ratio,
    main,
    minimum_table,
)


def test_the_study_gives_the_published_figures(tmp_path):
    assert main(["--out", str(tmp_path)]) == 0
    found, published = (
        json.loads((folder / "reproduce.json").read_text(encoding="utf-8"))
        for folder in (tmp_path, FOLDER)
    )
    for name in ("table8", "table9"):
        for symbol, row in published[name].items():
            assert found[name][symbol] == pytest.approx(row, rel=1e-6)
    assert found["minimum"]["half_width"] == pytest.approx(published["minimum"]["half_width"], rel=0.01)
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert agreement(published["comparison"]) in page
    assert minimum_table(published["minimum"]) in page
    assert np.max(np.abs(published["minimum"]["gradient"])) < 1e-3
    assert np.min(published["minimum"]["hessian_eigenvalues"]) > 0.1


@pytest.mark.parametrize("degrees", [5, 50, 18000])
def test_two_parameters_have_a_closed_form(degrees):
    """The quantile of F(2, n) is n/2 ((1 - p)^(-2/n) - 1), so the ratio is (1 - p)^(-2/n)."""
    assert limit_ratio(degrees + 2, 2) == pytest.approx(0.05 ** (-2 / degrees), rel=1e-9)


def test_differences_are_exact_for_a_quadratic():
    matrix = np.array([[2.0, 0.5], [0.5, 1.0]])
    gradient, hessian = differences(lambda z: 0.5 * float(z @ matrix @ z), np.array([1.0, -2.0]))
    np.testing.assert_allclose(gradient, matrix @ [1.0, -2.0], rtol=1e-6)
    np.testing.assert_allclose(hessian, matrix, rtol=1e-6)
