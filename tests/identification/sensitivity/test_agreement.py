"""Tables 8 and 9 come back, class by class, and the count can tell when they do not."""

import json
from dataclasses import replace

import pytest

from epv_env.plant.parameters import table
from identification.sensitivity.printed_agreement import (
    agreement_with_printed,
    is_reproduced,
    printed_rows,
    sensitivity_tables,
)
from tests.identification.sensitivity.study import one_at_a_time


def test_the_fixed_step_reproduces_tables_8_and_9():
    met = agreement_with_printed(one_at_a_time().fixed_step)
    assert met.figures == 46
    assert met.reproduced >= 36
    assert met.classes_differ == ()
    assert met.worst_factor < 2.0


def test_exact_stops_reproduce_fewer():
    met = agreement_with_printed(one_at_a_time().exact)
    assert met.reproduced >= 33
    assert met.classes_differ == ("RML",)


def test_another_class_is_noticed():
    rows = dict(one_at_a_time().fixed_step)
    rows["d1"] = replace(rows["d1"], minus=0.001, plus=0.001)
    met = agreement_with_printed(rows)
    assert met.classes_differ == ("d1",)
    assert met.worst_factor > 100
    assert met.reproduced == agreement_with_printed(one_at_a_time().fixed_step).reproduced - 2


@pytest.mark.parametrize(
    ("found", "printed", "expected"),
    [(11.0, 10.0, True), (11.1, 10.0, False), (0.12, 0.02, True), (0.13, 0.02, False)],
)
def test_tolerance_is_ten_percent_or_a_tenth_of_a_point(found, printed, expected):
    assert is_reproduced(found, printed) is expected


def test_the_tables_have_the_report_s_rows():
    content = json.loads(json.dumps(sensitivity_tables(one_at_a_time()), allow_nan=False))
    assert len(content["table8"]) == 17
    assert list(content["table9"]) == ["a1", "a2", "alphaMV", "alphaPV", "kMV", "kPV", "RML"]
    assert set(content["table8"]["cMV"]) == {"minus10", "plus10", "sensitive"}
    assert content["table8"]["d1"]["minus10"] == pytest.approx(19.3, rel=0.1)
    assert content["comparison"]["fixed_step"]["reproduced"] >= 36


def test_printed_rows_are_those_of_tables_6_and_7():
    assert set(printed_rows()) == {s for s, r in table().items() if r.source in ("Table 6", "Table 7")}


def test_a1_comes_back_with_the_ends_of_its_domain():
    row, printed = one_at_a_time().fixed_step["a1"], printed_rows()["a1"]
    assert (100 * row.minus, 100 * row.plus) == pytest.approx(printed, rel=0.05)
