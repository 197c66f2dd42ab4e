"""A diagnosis as JSON, and its numbers as people read them."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.block_bootstrap import Interval
from identification.gap.fit.laws import AS_ASSUMED
from identification.gap.report.gap_json import as_json, magnitudes, unit_name
from identification.gap.report.sentences import (
    gap_with_interval,
    probability_text,
    quantity,
    quantity_with_interval,
    share_text,
)
from tests.identification.gap.tanks import TANKS, diagnosed

MODELS = {"nominal", "recalibrated", "with_cause"}
PAGE = Path(__file__).parents[3] / "docs" / "reference" / "gap-json.md"


def documented() -> set[str]:
    """Fields of gap.json that the page describes."""
    table = PAGE.read_text(encoding="utf-8").split("## missing_term.json")[0]
    names = [re.findall(r"`([\w.]+)`", row) for row in re.findall(r"^\|(.*?)\|", table, re.M)]
    return {name.split(".")[0] for row in names for name in row}


@pytest.mark.parametrize("verdict", TANKS)
def test_every_verdict_has_the_fields_that_the_page_describes_and_no_others(verdict):
    content = json.loads(json.dumps(as_json(diagnosed(verdict), "Wait."), allow_nan=False))
    assert set(content) == documented() - {"seconds"} | {"format"}
    assert (content["format"], content["verdict"]) == ("epv-gap/4", verdict)
    assert content["next_experiment"] == "Wait."
    assert set(content["gap"]["report_metric_percent"]) == set(content["parameters"]) == MODELS
    remainder = content["left"]
    assert 0 <= remainder["low"] <= remainder["fraction"] <= remainder["high"] <= 1
    assert set(content["discrepancy"]) == set(content["where"]["channel"])
    judged = content["causes"][0]
    assert set(judged) >= {"effects", "probability", "magnitude", "shrink", "gap", "converged"}
    assert (judged["form"], judged["laws"]) == (AS_ASSUMED, []), "this tank simulates no laws"


@pytest.mark.parametrize("verdict", TANKS)
def test_probabilities_fall_and_sum_to_one(verdict):
    content = as_json(diagnosed(verdict))
    found = [cause["probability"] for cause in content["causes"]]
    assert found == sorted(found, reverse=True)
    others = content["probability"]["no_cause"] + content["probability"]["unknown"]
    assert sum(found) + others == pytest.approx(1.0)
    named = {"known": [["leak"]], "ambiguous": [["leak"], ["seep"]]}
    assert sorted(content["ambiguity_set"]) == named.get(verdict, [])
    assert content["indistinguishable"].get("leak", []) == (["seep"] if verdict == "ambiguous" else [])


def test_a_known_cause_is_the_whole_ambiguity_set_and_its_size_is_that_of_the_tank():
    content = as_json(diagnosed("known"))
    assert content["ambiguity_set"] == [["leak"]]
    value, low, high = content["causes"][0]["magnitude"]["leak_1_per_s"]
    assert low < value < high
    assert value == pytest.approx(4e-3, rel=0.1)
    assert content["parameters"]["with_cause"]["leak"] == value
    assert content["gap"]["with_cause"] == content["causes"][0]["gap"]
    assert content["causes"][0]["shrink"]["fraction"] > 0.9


@pytest.mark.parametrize(
    ("unit", "name"),
    [
        ("K/J", "K_per_J"), ("m^2", "m2"), ("1/m^2", "1_per_m2"), ("rad s/m", "rad_s_per_m"),
        ("A/(V s)", "A_per_V_s"), ("1", "1"), ("-", "1"), ("Ohm", "Ohm"),
    ],
)  # fmt: skip
def test_a_unit_as_part_of_a_name(unit, name):
    assert unit_name(unit) == name


def test_an_interval_stays_within_the_physical_range():
    found = diagnosed("known")
    cause = found.conclusion.causes[0]
    covariance = np.eye(len(cause.hypothesis.estimate.vector))
    wide = replace(cause, hypothesis=replace(cause.hypothesis, covariance=covariance))
    parameter = cause.hypothesis.estimate.hypothesis.parameters[0]
    ((_, low, high),) = magnitudes(found, wide).values()
    assert (low, high) == (parameter.low, parameter.high)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (2.4e-3, "S", "2.40 mS"),
        (2e-8, "m^2", "0.0200 mm^2"),
        (5e-6, "m^3", "5.00 cm^3"),
        (-5e3, "Pa", "-5.00 kPa"),
        (0.02, "kg", "0.0200 kg"),
        (2e4, "1/m^2", "20000 1/m^2"),
        (0.5, "1", "0.500"),
        (0.0, "V", "0 V"),
        (2.5e-5, "m2/s", "0.250 cm2/s"),
        (2.5e-5, "m²/s", "0.250 cm²/s"),
        (2.5e-5, "m**2/s", "0.250 cm**2/s"),
        (2.5e-5, "m³/s", "0.0250 dm³/s"),
        (2.5e-5, "m^4", "2.5e-05 m^4"),
        (2.5e-5, "m^2.5", "2.5e-05 m^2.5"),
        (2.5e-5, "m s^-2", "25.0 um s^-2"),
    ],
)
def test_a_prefix_scales_its_unit_and_the_unit_s_power(value, unit, text):
    assert quantity(value, unit) == text


def test_an_interval_has_one_unit():
    assert quantity_with_interval(2e-3, 9e-4, 3.1e-3, "s") == "2.00 (0.900 to 3.10) ms"


def test_nothing_is_certain_in_words():
    assert probability_text(1.0) == "> 99 %"
    assert probability_text(0.0) == "< 1 %"
    assert probability_text(0.534) == "53 %"


def test_shares_and_gaps():
    assert share_text(Interval(value=0.99, low=0.97, high=1.0)) == "99 % (97 to 100 %)"
    assert gap_with_interval(Interval(value=1.004, low=0.99, high=12.34)) == "1.00 (0.99 to 12.3)"
