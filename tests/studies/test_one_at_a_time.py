"""The report's sensitivity study comes back: Tables 8 and 9, without any measured data."""

from dataclasses import replace
from functools import cache

import pytest

from docs.studies.reproduction.study import (
    agreement_with_printed,
    changed_values,
    printed_sensitivities,
    sensitivities,
)
from epv_env.plant.parameters import Parameters, table
from identification.sensitivity import studied_symbols

PNEUMATIC = (
    "dMVexh", "R", "alphaMV", "V3", "cPV", "alphaPV", "V2", "dMVin", "d1", "d2", "xPV0", "xPVmax",
    "mPV", "kPV", "a1", "a2",
)  # fmt: skip
"""Whatever does not move the armature, and R, whose own effect on I is greater."""


@cache
def exact():
    """Tables 8 and 9 with the plant's own integrator."""
    return sensitivities(Parameters.nominal(), studied_symbols())


def test_exact_sensitivity_is_the_report_s():
    for symbol in PNEUMATIC:
        percents = exact()[symbol].percentages
        for value, reported in zip(percents, printed_sensitivities()[symbol], strict=True):
            limit = 0.1 if reported > 1 else 0.01
            assert value == pytest.approx(reported, rel=0.1, abs=limit), symbol


def test_exactly_located_stops_class_all_parameters_but_one_as_the_report():
    """RML, 2.04 % in the report, stays just below 2 %."""
    symbols = {symbol for symbol, row in exact().items() if row.sensitive}
    assert symbols == {symbol for symbol, row in table().items() if row.sensitive} - {"RML"}


def test_stroke_of_the_armature_weighs_little_because_bores_limit_the_flow():
    """With the curtain areas alone, xMVmax would weigh as much as dMVin (correction 3)."""
    assert exact()["xMVmax"].minus < 0.3 * exact()["dMVin"].minus


def test_a_parameter_that_is_zero_goes_to_the_ends_of_its_domain():
    assert changed_values("a1", 0.0) == (-0.1, 0.1)
    assert changed_values("a2", 2e-4) == pytest.approx((1.8e-4, 2.2e-4))


def test_other_conditions_give_other_figures():
    """The comparison can fail: at 24 V the armature's rows are far from the report's."""
    values = sensitivities(Parameters.nominal(), ["cMV"], U_on=24.0)["cMV"]
    assert 100 * values.minus < 0.6 * printed_sensitivities()["cMV"][0]


def test_the_count_notices_another_figure_and_another_class():
    met = agreement_with_printed(exact())
    assert (met["figures"], met["classes_differ"]) == (46, ["RML"])
    changed = exact() | {"d1": replace(exact()["d1"], minus=0.001, plus=0.001)}
    other = agreement_with_printed(changed)
    assert other["reproduced"] == met["reproduced"] - 2
    assert set(other["classes_differ"]) == {"RML", "d1"}
    assert other["worst_factor"] > 100
