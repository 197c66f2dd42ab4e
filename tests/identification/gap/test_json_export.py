"""A diagnosis as JSON."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.gap.fit.laws import AS_ASSUMED
from identification.gap.report.gap_json import as_json, magnitudes, unit_name
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
    assert (content["format"], content["verdict"]) == ("epv-gap/3", verdict)
    assert content["next_experiment"] == "Wait."
    assert set(content["gap"]["report_metric_percent"]) == set(content["parameters"]) == MODELS
    remainder = content["remainder"]
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
    assert sum(found) + sum(content["probability"].values()) == pytest.approx(1.0)
    named = {"known": [["leak"]], "ambiguous": [["leak"], ["seep"]]}
    assert sorted(content["ambiguity_set"]) == named.get(verdict, [])
    assert content["twins"].get("leak", []) == (["seep"] if verdict == "ambiguous" else [])


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
