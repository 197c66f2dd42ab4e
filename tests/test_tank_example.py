"""The tank of docs/examples obeys its closed forms, reads its files, and is diagnosed by one command."""

import json

import numpy as np
import pytest

from docs.examples.tank import (
    AREA,
    HEADER,
    START,
    Tank,
    levels,
    main,
    read_runs,
    readings,
    virtual_recordings,
    write_runs,
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


def test_recordings_come_back_from_their_files(tmp_path):
    written = virtual_recordings({"leak": 2e-3}, seed=1)
    write_runs(written, tmp_path)
    for one, other in zip(written, read_runs(tmp_path), strict=True):
        assert (one.name, one.held_out) == (other.name, other.held_out)
        np.testing.assert_allclose(other.time, one.time, atol=1e-9)
        np.testing.assert_allclose(other.measured, one.measured, atol=1e-6)
        np.testing.assert_allclose(other.inputs["q"], one.inputs["q"], rtol=1e-6)
    assert [run.held_out for run in written] == [False, False, True]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "line 1: the header is not"),
        (f"{HEADER}\n0,1,one\n", "give every line three numbers"),
        (f"{HEADER}\n0,1,1\n0.5,1,1\n2,1,1\n", "not uniform from 0"),
        (f"{HEADER}\n0,1,1\n0.5,nan,1\n1,1,1\n", "not finite"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_in_a_sentence(text, said, tmp_path):
    (tmp_path / "test_1.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=rf"test_1\.csv.*{said}"):
        read_runs(tmp_path)


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


def test_a_folder_without_recordings_is_refused(tmp_path):
    with pytest.raises(ValueError, match="has no CSV files: give a folder of recordings"):
        read_runs(tmp_path)
