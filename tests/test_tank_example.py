"""The tank of docs/examples obeys its closed forms, and is diagnosed by one command."""

import json

import numpy as np
import pytest

from docs.examples.tank import (
    AREA,
    START,
    Tank,
    levels,
    main,
    readings,
    virtual_recordings,
)
from identification.gap.plant import window_forcing

PERIOD = 0.5


def test_a_draining_tank_follows_torricelli_to_first_order():
    c, time = 0.02, PERIOD * np.arange(61)
    exact = (np.sqrt(START) - c * time / 2) ** 2
    errors = [
        np.max(np.abs(levels({"c": np.array([c])}, np.zeros(60 * m + 1), PERIOD / m)[::m, 0] - exact))
        for m in (1, 10)
    ]
    assert errors[0] < 5e-4
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.01)


def test_a_tank_settles_where_outflow_and_leak_are_the_inflow():
    c, leak = 0.02, 4e-3
    values = {"c": np.array([c]), "leak": np.array([leak])}
    h = levels(values, np.full(4000, 0.008), PERIOD)[-1, 0]
    assert c * np.sqrt(h) + leak * h == pytest.approx(0.008 / AREA, rel=1e-9)


def test_a_lagging_sensor_is_63_percent_there_after_its_time_constant():
    level = np.r_[0.0, np.ones(20)][:, None]
    read = readings({"lag": np.array([5.0]), "zero": np.array([0.1])}, level, PERIOD)[:, 0]
    assert read[10] - 0.1 == pytest.approx(1 - np.exp(-1.0))


def test_forcings_of_all_windows_make_that_of_the_whole_run():
    plant = Tank(virtual_recordings({}))
    values = {"c": np.array([0.021])}
    whole, parts = (
        plant.forced(values, 0, window_forcing(plant.equations[0], 240, np.array(edges)))
        for edges in ([0, 240], [0, 30, 100, 240])
    )
    assert whole.shape == (1, 240, 1)
    assert np.max(np.abs(whole)) > 1e-4
    np.testing.assert_allclose(np.sum(parts, axis=2), whole[..., 0], rtol=2e-2, atol=1e-6)


def test_the_command_finds_the_leak(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("sys.argv", ["tank", "--out", str(tmp_path)])
    assert main() == 0
    assert "leak explains the gap" in capsys.readouterr().out
    found = json.loads((tmp_path / "gap.json").read_text(encoding="utf-8"))
    assert found["verdict"] == "known"
    assert found["ambiguity_set"] == [["leak"]]
    low, high = found["causes"][0]["magnitude"]["leak_1_per_s"][1:]
    assert low <= 4e-3 <= high
    assert "data:image/svg+xml" in (tmp_path / "report.html").read_text(encoding="utf-8")
