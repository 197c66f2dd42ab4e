"""A sweep's designs cover what they promise and stay inside it; it survives being killed."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

pytest.importorskip("joblib")
from epv_env.common.commands import main_of
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import table
from epv_env.plant.plantfile import Plant, save_plant
from epv_env.settings import make_settings
from training.studies.sweep import ONE_AT_A_TIME, harmful_changes, parameters

pytestmark = pytest.mark.training

PLANT = Plant.calibrated()
ROOT = Path(__file__).parents[2]
SHORT = (
    "--designs", "conditions", "--factors", "sensor noise", "control period",
    "--episodes", 3, "--duration", 0.55,
    "--controllers", "extrapolating hysteresis",
)  # fmt: skip
"""A sweep of a few seconds."""
BATCHES = 4 + 4
"""Levels of both factors of SHORT."""


def test_every_point_is_one_that_the_environment_takes():
    for make in ONE_AT_A_TIME.values():
        for point in make(PLANT):
            make_settings(PLANT, **{"control_period": 5e-3, **point.options})


def test_the_parameters_are_those_of_tables_6_and_7_and_the_environment():
    factors = {point.factor for point in parameters(PLANT)}
    groups = {"partially known", "unknown", "environment"}
    named = {s for s, row in table().items() if row.group in groups}
    assert factors == named - set(CATALOGUE["local_gas_speed"])


def test_a_change_hurts_if_its_interval_lies_above_the_nominal_one():
    common = {"design": "parameters", "controller": "c", "left_high": 1.0}
    points = pd.DataFrame(
        [
            {**common, "design": "regions", "factor": "region", "level": "exact", "left": 0.0,
             "left_low": 0.0, "left_high": 0.03},
            {**common, "factor": "R", "level": "+10 %", "left": 0.2, "left_low": 0.1},
            {**common, "factor": "R", "level": "-10 %", "left": 0.02, "left_low": 0.01},
        ]
    )  # fmt: skip
    found = harmful_changes(points)
    assert found.to_dict("records") == [
        {"controller": "c", "changed": "parameters", "tried": 2, "hurt": 1,
         "highest violation rate [%]": "R +10 % (20)"}
    ]  # fmt: skip


def sweep(out, *arguments):
    words = [str(word) for word in (*SHORT, *arguments, "--out", out)]
    return main_of("training.commands.sweep", program="sweep", arguments=words)


def finished(out):
    """Names of the batches in a sweep's journal, as they finished; torn lines do not count."""
    path = out / "finished.jsonl"
    text = path.read_text() if path.exists() else ""
    complete = text[: text.rfind("\n") + 1]
    return [json.loads(line)["name"] for line in complete.splitlines()[1:]]


def test_two_workers_and_a_killed_sweep_give_the_same_to_the_bit(tmp_path):
    assert sweep(tmp_path / "alone", "--workers", 1) == 0
    out = tmp_path / "killed"
    words = [sys.executable, ROOT / "training/sweep.py", *SHORT, "--workers", 2, "--out", out]
    process = subprocess.Popen(
        [str(word) for word in words], cwd=ROOT, start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    while len(finished(out)) < 3 and process.poll() is None:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    before = finished(out)
    assert 3 <= len(before) < BATCHES  # it was killed in mid-sweep
    assert sweep(out, "--workers", 2) == 0
    after = finished(out)
    assert after[: len(before)] == before  # nothing was lost
    assert len(after) == len(set(after)) == BATCHES  # nor done twice
    for name in ("results.json", "points.csv"):
        assert (out / name).read_bytes() == (tmp_path / "alone" / name).read_bytes()


def test_a_plant_of_other_sensors_is_refused_in_the_folder_of_the_first(tmp_path, capsys):
    quick = ("--factors", "sensor noise", "--workers", 1, "--plant", tmp_path / "plant.json")
    p2 = PLANT.sensors["p2"]
    for noise, status in ((p2.noise, 0), (5 * p2.noise, 2)):
        sensors = {**PLANT.sensors, "p2": replace(p2, noise=noise)}
        save_plant(replace(PLANT, sensors=sensors), tmp_path / "plant.json")
        assert sweep(tmp_path / "out", *quick) == status
        assert len(set(finished(tmp_path / "out"))) == len(finished(tmp_path / "out")) == 4
    assert "finished.jsonl holds results with plant.sensors" in capsys.readouterr().err
