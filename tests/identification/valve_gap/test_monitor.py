"""A valve that is followed by its log: what differs from the start, what changes, and what is mended."""

import json
import shutil
from dataclasses import replace

import pytest

from controllers.tuned import tuned
from epv_env.plant.plantfile import Plant, save_plant
from identification.__main__ import main
from identification.valve_gap.logged_valve import logged_valve
from identification.valve_gap.monitor import IN_SIGHT, gain_in
from training.drives import write_log

PLANT = Plant.calibrated()
DRIVES = {"duration": 20.0, "scenario": "steps"}


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    """Plant file and log of a valve with friction that is never as the report's."""
    folder = tmp_path_factory.mktemp("other")
    p = PLANT.parameters
    valve = replace(PLANT, parameters=p.replace(R=1.04 * p["R"], F_PV=8.0))
    save_plant(valve, folder / "plant.json")
    write_log(folder / "log", tuned("extrapolating hysteresis"), valve, range(3), **DRIVES)
    return folder


def test_a_valve_that_stays_as_it_was_learnt_gives_no_alarm(other, capsys):
    log, plant, out = (str(other / name) for name in ("log", "plant.json", "out"))
    assert main(["monitor", log, "--plant", plant, "--out", out]) == 0
    assert "No drive shows a change" in capsys.readouterr().out
    assert "No drive shows a change" in (other / "out" / "report.html").read_text()


def test_with_another_s_plant_file_the_same_valve_differs(other):
    _, valve = logged_valve(other / "log", PLANT)
    assert gain_in(valve, known=True) > IN_SIGHT


def test_cause_onset_and_repair_are_told(tmp_path, capsys):
    eddy = {"eddy_current": {"G_eddy": 0.004}}
    folder, repaired = tmp_path / "log", tmp_path / "repaired"
    controller = tuned("extrapolating hysteresis")
    write_log(folder, controller, PLANT, range(3), effects=eddy, onset=1, **DRIVES)
    write_log(repaired, controller, PLANT, [3], **DRIVES)
    shutil.copy(repaired / "drive-1.csv", folder / "drive-4.csv")
    manifest = json.loads((folder / "log.json").read_text())
    manifest["drives"].append({"file": "drive-4.csv"})
    (folder / "log.json").write_text(json.dumps(manifest))
    assert main(["monitor", str(folder), "--learn", "4", "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().out
    assert "changed since drive-2.csv (> 99 %): eddy current" in told
    assert "mended since drive-4.csv" in told
    content = json.loads((tmp_path / "out" / "learnt" / "gap.json").read_text())
    assert content["causes"][0]["effects"] == ["eddy_current"]
    assert content["onset"] == content["causes"][0]["onset"]["eddy_current"]
    assert (content["onset"]["drive"], content["onset"]["mended"]) == ("drive-2.csv", "drive-4.csv")
