"""Known columns have known collinearity; parameters that act by their ratio cannot be told apart."""

import json
from functools import cache

import numpy as np
import pytest

from epv_env.plant.channels import SENSORS
from epv_env.plant.parameters import Parameters, confidence_intervals, sensitive_symbols
from identification import sensitivity
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
)
from identification.sensitivity import (
    CRITICAL_INDEX,
    OutputSensitivities,
    collinearity_index,
    cosines,
    sensitivities_on_recordings,
    sensitivity_json,
    sensitivity_section,
    studied_symbols,
)


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
    monkeypatch.setattr(sensitivity, "DIFFERENCE_STEP", 1e-3)
    finer = sensitivities_in_cases()
    assert finer.effect == pytest.approx(usual, rel=0.01)


def test_section_and_data(tmp_path):
    section = sensitivity_section(nominal_sensitivities())
    assert [verdict.status for verdict in section.verdicts] == ["good", "note"]
    effects, pairs = section.blocks
    assert isinstance(effects, Table)
    assert isinstance(pairs, Table)
    values = [float(value) for _, value in effects.rows]
    assert values == sorted(values, reverse=True)
    assert len(values) == len(studied_symbols())
    rows = [(", ".join(sorted(pair.split(", "))), index) for pair, index in pairs.rows]
    assert ("V2, alphaPV", "infinite") in rows
    write_page(tmp_path / "page.html", title="Sensitivity", sections=[section])
    data = json.loads(json.dumps(sensitivity_json(nominal_sensitivities()), allow_nan=False))
    assert data["collinearity"]["all_sensitive"] is None
