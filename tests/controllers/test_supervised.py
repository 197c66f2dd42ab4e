"""A supervisor's settings lie beside the policy's weights, and are checked when they are read."""

import json
import shutil

import numpy as np
import pytest

from controllers.learned import TRAINED
from controllers.supervised import (
    SUPERVISOR_FILE,
    SupervisorFile,
    SupervisorFileError,
    load_settings,
    load_supervised,
    save_settings,
)
from controllers.supervisor import SETTINGS, SupervisorSettings
from training.evaluation.rollout import run_episodes

PACKAGED = TRAINED / "end-to-end" / "seed-0"


@pytest.fixture
def folder(tmp_path):
    for file in ("policy.json", "policy.safetensors"):
        shutil.copy(PACKAGED / file, tmp_path)
    return tmp_path


def test_settings_come_back_as_they_were_written(folder):
    content = SupervisorFile(settings=SupervisorSettings(height=-0.02), search={"episodes": 8})
    save_settings(content, folder)
    assert load_settings(folder) == content
    assert load_supervised(folder).settings.height == -0.02


def test_a_folder_without_settings_gets_the_default(folder):
    assert load_settings(folder) is None
    assert load_supervised(folder).settings == SETTINGS


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"format": "epv-supervisor/9"}, "this version reads"),
        ({"settings": {"height": "low"}}, "height"),
        ({"settings": {"height": 7.0}}, "height = 7 bar"),
        ({"settings": {"filter_time": 0}}, "filter_time = 0 s"),
    ],
)
def test_wrong_files_get_one_sentence(folder, change, words):
    save_settings(SupervisorFile(settings=SETTINGS), folder)
    path = folder / SUPERVISOR_FILE
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(SupervisorFileError, match=words) as refusal:
        load_supervised(folder)
    assert "\n" not in str(refusal.value)


def test_the_packaged_policy_holds_the_band_under_its_supervisor():
    options = {"parameters": "sensitive_ten_percent"}
    control = load_supervised(PACKAGED)
    assert control.name == "PPO, end to end, supervised"
    metrics, _ = run_episodes(control, seeds=list(range(64)), duration=5.0, options=options)
    assert np.all(metrics.stayed)
    assert metrics.rms_bar.mean() < 0.1
