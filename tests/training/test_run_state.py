"""A run's state is one unit with an identity: damaged, foreign or mixed state is refused."""

import io
import json
import zipfile

import pytest

pytest.importorskip("stable_baselines3")

from training.learners.run_folder import forget_failed_start, make_free
from training.learners.run_state import (
    BEST_ENTRY,
    CHECKPOINT_FILE,
    PROGRESS_ENTRY,
    RUN_ENTRY,
    Checkpoint,
    Run,
    RunError,
    load_run,
    save_run,
    unfinished_run,
)

pytestmark = pytest.mark.training

SUBJECT = {"seed": 1, "plant": "abc"}
RUN = Run(run="one", subject=SUBJECT, timesteps=64, curve=[{"timesteps": 64.0, "success_rate": None}])

STATE = Checkpoint(RUN, b"best", b"progress")


def archive() -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as file:
        file.writestr("policy.pth", b"weights" * 100)
    return stream.getvalue()


@pytest.fixture
def folder(tmp_path):
    save_run(tmp_path / CHECKPOINT_FILE, STATE, model=archive())
    return tmp_path


def test_what_is_saved_is_loaded(folder):
    assert unfinished_run(folder, SUBJECT, None) == STATE
    with zipfile.ZipFile(folder / CHECKPOINT_FILE) as file:  # still an archive of the model
        assert set(file.namelist()) == {"policy.pth", RUN_ENTRY, PROGRESS_ENTRY, BEST_ENTRY}


def test_another_run_or_subject_is_refused(folder):
    with pytest.raises(RunError, match="belongs to the training run one, not to two"):
        unfinished_run(folder, SUBJECT, "two")
    with pytest.raises(RunError, match="with another seed"):
        unfinished_run(folder, SUBJECT | {"seed": 2}, None)


@pytest.mark.parametrize("kept", [0, 1, 50, 200, -1])
def test_a_torn_checkpoint_is_refused(folder, kept):
    path = folder / CHECKPOINT_FILE
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(RunError, match="give --force to begin anew"):
        load_run(path)


def test_every_flipped_byte_of_what_counts_is_noticed(folder):
    path = folder / CHECKPOINT_FILE
    whole = path.read_bytes()
    for place in range(40, 700, 97):  # in the weights
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 255]) + whole[place + 1 :])
        with pytest.raises(RunError):
            load_run(path)


@pytest.mark.parametrize(
    "content",
    [b"[]", b"{}", b"[" * 100_000, b'{"run": 3, "subject": {}}', b'{"run": "a", "subject": {}, "x": 1}'],
)
def test_a_checkpoint_whose_run_has_another_shape_is_refused(tmp_path, content):
    with zipfile.ZipFile(tmp_path / CHECKPOINT_FILE, "w") as file:
        file.writestr(RUN_ENTRY, content)
    with pytest.raises(RunError, match="no checkpoint of a training run"):
        load_run(tmp_path / CHECKPOINT_FILE)


def test_a_lost_checkpoint_is_no_new_beginning(tmp_path):
    assert unfinished_run(tmp_path, SUBJECT, "one") is None
    (tmp_path / "learning_curve.csv").write_text("")
    with pytest.raises(RunError, match="put the checkpoint back"):
        unfinished_run(tmp_path, SUBJECT, "one")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("policy.json", "holds a finished training"),
        ("checkpoint.zip", "holds an unfinished training"),
        ("thesis.tex", "holds 'thesis.tex', which no training writes"),
    ],
)
def test_a_folder_that_is_not_free_is_taken_only_by_force(tmp_path, name, words):
    (tmp_path / name).write_text("mine")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(RunError, match=words):
        make_free(tmp_path, force=False)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
    make_free(tmp_path, force=True)
    assert {path.name for path in tmp_path.iterdir()} <= {"thesis.tex"}


def test_a_failed_start_is_forgotten_and_a_student_is_not(tmp_path):
    (tmp_path / "config.json").write_text(json.dumps({}))
    (tmp_path / "student").mkdir()
    forget_failed_start(tmp_path)
    assert (tmp_path / "config.json").exists()
    (tmp_path / "student").rmdir()
    forget_failed_start(tmp_path)
    assert not list(tmp_path.iterdir())
