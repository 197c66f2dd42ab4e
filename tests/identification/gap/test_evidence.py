"""What the recordings leave open of a fit's numbers, and what a cause costs."""

from dataclasses import replace

import numpy as np
import pytest

from identification.gap.evidence import EvaluatedHypothesis, _covariance
from identification.gap.variable_projection import LinearisedRun, normal_equations
from tests.identification.gap.tanks import diagnosed

ALONG = np.array([1.0, 1.0])


def test_what_no_reading_tells_is_wide_but_known_to_be():
    """A hessian that rounding has made indefinite still gives variances."""
    hessian = 1e8 * np.outer(ALONG, ALONG) - 1e-7 * np.eye(2)
    assert np.min(np.linalg.eigvalsh(hessian)) <= 0
    none = np.zeros((3, 0))
    run = LinearisedRun(
        residual=np.zeros(3), slopes=np.eye(3)[:, :2], run_slopes=none, run_values=np.zeros(0),
        run_sd=np.zeros(0), tolerance_slopes=none,
    )  # fmt: skip
    equations = replace(normal_equations([run]), hessian=hessian)
    found = _covariance(equations)
    assert np.all(np.diag(found) > 1.0)
    assert ALONG @ found @ ALONG == pytest.approx(1e-8, rel=1e-3)


def leaking() -> EvaluatedHypothesis:
    hypothesis = diagnosed("known").ranking.hypotheses[0]
    assert hypothesis.labels == ("leak",)
    return hypothesis


def test_a_cause_costs_the_log_of_its_range_over_what_the_data_leave():
    found = leaking()
    sd = np.sqrt(found.covariance[1, 1])
    alone = np.log(0.05 / (np.sqrt(2 * np.pi) * sd))
    assert found.price(1.0, least=0.0) == pytest.approx(alone, rel=1e-3)
    assert found.price(4.0, least=0.0) == pytest.approx(alone - np.log(2.0), rel=1e-3)


def test_no_cause_costs_less_than_the_least_price():
    assert leaking().price(1e12, least=3.0) == 3.0


def test_causes_that_act_alike_cost_more_together_than_one_after_the_other():
    found = leaking()
    evaporating = next(
        h for h in diagnosed("known").ranking.hypotheses if set(h.labels) == {"leak", "evaporation"}
    )
    assert evaporating.price(1.0, least=0.0) > found.price(1.0, least=0.0)
