"""The folder of one training: begun only where it is free, or where its owner says so."""

import shutil
from pathlib import Path

from controllers.policy_contract import CONTRACT_FILE, WEIGHTS_FILE
from controllers.supervised import SUPERVISOR_FILE
from epv_env.common.results_folder import CONFIG, LOCK_FILE
from training.learners.run_state import CHECKPOINT_FILE, DERIVED_FILES, RunError

MEMORYLESS_FOLDER, STUDENT_FOLDER = "memoryless", "student"
"""Within the folder of a recurrent policy: what it was trained from."""

TENSORBOARD_FOLDER = "tensorboard"
"""Within the folder of a training: what `tensorboard --logdir` shows."""

TRACKING_FOLDER = "wandb"
"""Within the folder of a training: what the package wandb writes (training/learners/tracking.py)."""

REPORT_FILES = ("table.csv", "table.json", "learning_curve.png", "episode.png", "excursions.png")
"""What the command that trains writes at its end."""

# The contract first: a folder without it holds no policy, and without a checkpoint no run to resume.
OWN_FILES = (
    CONTRACT_FILE, CHECKPOINT_FILE, CONFIG, WEIGHTS_FILE, SUPERVISOR_FILE, *DERIVED_FILES, *REPORT_FILES,
)  # fmt: skip
OWN_FOLDERS = (STUDENT_FOLDER, MEMORYLESS_FOLDER, TENSORBOARD_FOLDER, TRACKING_FOLDER)


def make_free(folder: Path, *, force: bool) -> None:
    """Prepare a folder for a new training.

    Raises RunError if it holds anything, unless `force`: then what a training writes there is removed,
    and other files stay.
    """
    if not force and (taken := why_taken(folder)) is not None:
        raise RunError(taken)
    for name in OWN_FILES:
        (folder / name).unlink(missing_ok=True)
    for name in OWN_FOLDERS:
        shutil.rmtree(folder / name, ignore_errors=True)


def forget_failed_start(folder: Path) -> None:
    """Remove the configuration of a training that ended before it had anything to keep."""
    if _content(folder) == {CONFIG}:
        (folder / CONFIG).unlink()


def _content(folder: Path) -> set[str]:
    """Names of what lies in a folder, but the lock."""
    return {path.name for path in folder.iterdir()} - {LOCK_FILE} if folder.exists() else set()


def why_taken(folder: Path) -> str | None:
    """Why a new training cannot begin in a folder, and what to do; None if it is free."""
    present = _content(folder)
    if not present:
        return None
    if foreign := sorted(present - {*OWN_FILES, *OWN_FOLDERS}):
        return (
            f"{folder} holds {foreign[0]!r}, which no training writes: choose a new or empty --out, or "
            "give --force to train there all the same"
        )
    if CONTRACT_FILE in present:
        return (
            f"{folder} holds a finished training: give --force to replace it, --resume to train it on, "
            "or choose another --out"
        )
    return (
        f"{folder} holds an unfinished training: give --resume to go on, --force to begin anew, or "
        "choose another --out"
    )
