"""The tank of docs/examples obeys its closed forms, reads its files, and is diagnosed by one command."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from docs.examples.tank.plant import Tank
from docs.examples.tank.recordings import HEADER, read_runs, virtual_recordings, write_runs
from docs.examples.tank.simulator import AREA, START, levels, readings

ROOT = Path(__file__).parents[1]
PERIOD = 0.5


def ran(*options: object) -> subprocess.CompletedProcess:
    command = (sys.executable, "-m", "docs.examples.tank", *map(str, options))
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)


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
        plant.forced(values, plant.equations[0], 0, np.array(edges))
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
        ("time,level\n0,1\n", "line 1: the header is not"),
        (f"{HEADER}\n0,1,one\n", "give every line three numbers"),
        (f"{HEADER}\n0,1,1\n0.5,1\n", "give every line three numbers"),
        (f"{HEADER}\n0,1,1\n0.5,1,1\n2,1,1\n", "not uniform from 0"),
        (f"{HEADER}\n0,1,1\n", "not uniform from 0"),
        (f"{HEADER}\n0,1,1\n0.5,nan,1\n1,1,1\n", "not finite"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_in_a_sentence(text, said, tmp_path):
    (tmp_path / "test_1.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=rf"test_1\.csv.*{said}"):
        read_runs(tmp_path)


def test_the_command_finds_the_leak(tmp_path):
    done = ran("--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "leak explains the gap" in done.stdout
    found = json.loads((tmp_path / "gap.json").read_text(encoding="utf-8"))
    assert found["verdict"] == "known"
    assert found["ambiguity_set"] == [["leak"]]
    low, high = found["causes"][0]["magnitude"]["leak_1_per_s"][1:]
    assert low <= 4e-3 <= high
    assert "data:image/svg+xml" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert sorted(path.stem for path in (tmp_path / "recordings").iterdir()) == [
        "test_1", "test_2", "validation",
    ]  # fmt: skip


def test_a_folder_without_recordings_is_refused_in_a_sentence(tmp_path):
    done = ran("--out", tmp_path / "out", "--recordings", tmp_path)
    assert done.returncode == 2
    assert done.stderr == f"error: {tmp_path} has no CSV files: give a folder of recordings\n"
