"""Sensitivities: Tables 8 and 9 come back; known columns have known collinearity."""

import json
from functools import cache

import numpy as np
import pytest

from epv_env.plant.channels import SENSORS
from epv_env.plant.parameters import Parameters, confidence_intervals, sensitive_symbols, table
from identification.recordings.recording import OUTPUTS, UNITS
from identification.replay.model_inputs import ModelInputs
from identification.replay.replay import Replay
from identification.report.page import Table, write_page
from identification.report_2003 import (
    CALIBRATION_CASES,
    CIRCUIT_PRESSURE,
    ENERGISED_VOLTAGE,
    SAMPLING_RATE,
    SUPPLY_PRESSURE,
    printed_sensitivities,
)
from identification.sensitivity import collinearity
from identification.sensitivity.collinearity import (
    CRITICAL_INDEX,
    OutputSensitivities,
    collinearity_index,
    cosines,
    sensitivities_on_recordings,
)
from identification.sensitivity.one_at_a_time import changed_values, sensitivities, studied_symbols
from identification.sensitivity.section import sensitivity_json, sensitivity_section


def sensitivities_in_cases() -> OutputSensitivities:
    """In the report's test cases, with Table 3's noise."""
    drives = [
        ModelInputs(
            period=1 / SAMPLING_RATE,
            U=(U := case.voltage(ENERGISED_VOLTAGE, SAMPLING_RATE)),
            p1=np.full(len(U), SUPPLY_PRESSURE),
            sigma_S=np.zeros(len(U)),
            U_start=ENERGISED_VOLTAGE,
            p2_start=CIRCUIT_PRESSURE,
        )
        for case in CALIBRATION_CASES
    ]
    noise = {name: SENSORS[name].noise * UNITS[name][1] for name in OUTPUTS}
    return sensitivities_on_recordings(Replay(drives, Parameters.nominal()), studied_symbols(), noise)


@cache
def nominal_sensitivities() -> OutputSensitivities:
    return sensitivities_in_cases()


@pytest.mark.parametrize("angle", [0.05, 0.3, 1.2])
def test_two_columns_at_an_angle(angle):
    """The least eigenvalue of [[1, c], [c, 1]] is 1 - |c|."""
    columns = np.array([[1.0, np.cos(angle)], [0.0, np.sin(angle)]])
    assert collinearity_index(columns) == pytest.approx(1 / np.sqrt(1 - np.cos(angle)))
    assert cosines(columns)[0, 1] == pytest.approx(np.cos(angle))


@pytest.mark.parametrize("pair", [("V2", "alphaPV"), ("V3", "alphaMV")])
def test_volumes_and_contractions_act_by_their_ratio(pair):
    """alphaPV/V2 and alphaMV/V3 are all that the state equations of p2 and p3 contain."""
    assert nominal_sensitivities().index(pair) == np.inf
    correlation = cosines(nominal_sensitivities().columns)
    rows = [nominal_sensitivities().symbols.index(symbol) for symbol in pair]
    assert correlation[rows, 0].sum() == pytest.approx(0.0, abs=1e-6)


def test_the_calibrated_four_can_be_told_apart_but_not_all_sensitive_ones():
    assert nominal_sensitivities().index(tuple(confidence_intervals())) < 4.0 < CRITICAL_INDEX
    assert nominal_sensitivities().index(sensitive_symbols()) == np.inf


def test_effects_do_not_depend_on_the_size_of_the_differences(monkeypatch):
    """The model is differentiable here: event times move smoothly with every parameter."""
    usual = nominal_sensitivities().effect
    monkeypatch.setattr(collinearity, "DIFFERENCE_STEP", 1e-3)
    finer = sensitivities_in_cases()
    assert finer.effect == pytest.approx(usual, rel=0.01)


def test_section_and_data(tmp_path):
    section = sensitivity_section(exact(), nominal_sensitivities())
    assert [verdict.status for verdict in section.verdicts] == ["good", "note"]
    errors, pairs = section.blocks
    assert isinstance(errors, Table)
    assert isinstance(pairs, Table)
    assert len(errors.rows) == len(exact())
    assert ["V2, alphaPV", "infinite"] in [sorted_pair(row) for row in pairs.rows]
    write_page(tmp_path / "page.html", title="Sensitivity", sections=[section])
    data = json.loads(json.dumps(sensitivity_json(exact(), nominal_sensitivities()), allow_nan=False))
    assert data["collinearity"]["all_sensitive"] is None
    assert data["exact"]["R"]["sensitive"]


def sorted_pair(row):
    return [", ".join(sorted(row[0].split(", "))), row[1]]


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
