"""A supervisor's settings lie beside the policy's weights, and are checked when they are read."""

import json
import shutil
from dataclasses import asdict

import numpy as np
import pytest

from controllers.learned import TRAINED
from controllers.p3_check import P3Check
from controllers.supervised import (
    SUPERVISOR_FILE,
    SupervisorFile,
    SupervisorFileError,
    load_settings,
    load_supervised,
    p3_checked,
    save_settings,
)
from controllers.supervisor import Supervisor
from controllers.supervisor_settings import SETTINGS, SupervisorSettings
from epv_env.plant.plantfile import Plant
from training.evaluation.rollout import run_episodes
from training.evaluation.scenarios import BEYOND, TUNING_REGION

ALL = asdict(SETTINGS)
PACKAGED = TRAINED / "end-to-end" / "seed-0"


@pytest.fixture
def folder(tmp_path):
    for file in ("policy.json", "policy.safetensors"):
        shutil.copy(PACKAGED / file, tmp_path)
    return tmp_path


def settings_of(control: P3Check) -> SupervisorSettings:
    assert isinstance(control.main, Supervisor)
    return control.main.settings


def test_settings_come_back_as_they_were_written(folder):
    content = SupervisorFile(settings=SupervisorSettings(height=-0.02), search={"episodes": 8})
    save_settings(content, folder)
    assert load_settings(folder) == content
    assert settings_of(load_supervised(folder)).height == -0.02


def test_a_folder_without_settings_gets_the_default(folder):
    assert load_settings(folder) is None
    assert settings_of(load_supervised(folder)) == SETTINGS


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"format": "epv-supervisor/9"}, "this version reads"),
        ({"settings": ALL | {"height": "low"}}, "settings, height: expected float"),
        ({"settings": ALL | {"height": 7.0}}, "height = 7 bar"),
        ({"settings": ALL | {"filter_time": 0}}, "filter_time = 0 s"),
        ({"settings": ALL | {"hieght": 0.0}}, "'hieght' is no setting"),
        ({"settings": {"hieght": 0.0}}, "'hieght' is no setting"),
        ({"settings": {"height": 0.0}}, "'ceiling' is missing"),
    ],
)
def test_wrong_files_get_one_sentence(folder, change, words):
    save_settings(SupervisorFile(settings=SETTINGS), folder)
    path = folder / SUPERVISOR_FILE
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(SupervisorFileError, match=words) as refusal:
        load_supervised(folder)
    assert "\n" not in str(refusal.value)


def test_a_controller_whose_p3_is_checked_gets_no_second_check(folder):
    control = load_supervised(folder)
    assert p3_checked(control, Plant.calibrated()) is control


def test_the_packaged_policy_holds_the_band_under_its_supervisor():
    options = {"parameters": "sensitive_ten_percent"}
    control = load_supervised(PACKAGED)
    assert control.name == "PPO, end to end, supervised"
    metrics, _ = run_episodes(control, seeds=list(range(64)), duration=5.0, options=options)
    assert np.all(metrics.stayed)
    assert metrics.rms_bar.mean() < 0.1


def test_it_survives_a_p3_that_freezes_as_often_as_the_controller_behind_the_check():
    scenario = BEYOND["p3 frozen"]
    control = load_supervised(PACKAGED)
    left = []
    for each in (control.main, control):
        metrics, _ = run_episodes(
            each, seeds=list(range(3_500_000, 3_500_064)), duration=6.0,
            options={"scenario": "mixed", "parameters": TUNING_REGION, **scenario.options},
        )  # fmt: skip
        left.append(np.sum(~metrics.stayed))
    assert left[0] > 16
    assert left[1] < 8
