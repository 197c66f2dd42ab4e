"""The state of a training run in one file: model, best model, learning curve and validations.

The checkpoint is stable-baselines3's archive of the model with two entries more. It is replaced as a
whole, so that no two parts of it come from different moments, and it names the run that it belongs to.
"""

import io
import json
import uuid
import zipfile
from collections.abc import Mapping
from math import isnan, nan
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from epv_env.common.files import write_bytes

FORMAT = "epv-training-run/1"
CHECKPOINT_FILE = "checkpoint.zip"
RUN_ENTRY, BEST_ENTRY, PROGRESS_ENTRY = "run.json", "best.zip", "progress.npz"
DERIVED_FILES = ("learning_curve.csv", "validation.csv", "model.zip")
"""Files that a run writes for its user with every checkpoint; it never reads them."""

Row = dict[str, float]
"""One row of a table of numbers, by column."""


class RunError(ValueError):
    """A training run cannot go on: the message says why and what to do."""


class Run(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """What a training run has done so far, beside its networks."""

    format: str = FORMAT
    """Version of this form."""
    run: str
    """Identity, drawn when the run began."""
    subject: dict[str, Any]
    """All that the result depends on, as JSON gives it back."""
    timesteps: int = 0
    """Environment steps that the model has learned from."""
    curve: list[dict[str, float | None]] = []
    """Rows of the learning curve."""
    validations: list[dict[str, float | None]] = []
    """Rows of the validations."""


def new_run() -> str:
    """An identity that no other run has."""
    return uuid.uuid4().hex


class Checkpoint(NamedTuple):
    """What a checkpoint holds beside the model's networks."""

    run: Run
    best: bytes | None
    """stable-baselines3's archive of the best validated model; None: none was validated."""
    progress: bytes
    """Environments and generators (training/learners/resumption.py)."""


def save_run(path: Path, checkpoint: Checkpoint, *, model: bytes) -> None:
    """Write the state of a run, whole or not at all.

    Args:
        path: of the checkpoint.
        checkpoint: what to write beside the model.
        model: stable-baselines3's archive of the model.
    """
    stream = io.BytesIO(model)
    with zipfile.ZipFile(stream, "a") as archive:
        archive.writestr(RUN_ENTRY, msgspec.json.encode(checkpoint.run))
        archive.writestr(PROGRESS_ENTRY, checkpoint.progress)
        if checkpoint.best is not None:
            archive.writestr(BEST_ENTRY, checkpoint.best)
    write_bytes(path, stream.getvalue())


def load_run(path: Path) -> Checkpoint:
    """What a checkpoint holds beside the model's networks.

    Raises RunError if the checkpoint is missing, damaged, or of another version.
    """
    remedy = "give --force to begin anew, or choose another --out"
    try:
        with zipfile.ZipFile(path) as archive:
            if (torn := archive.testzip()) is not None:
                raise RunError(f"{path} is damaged in its entry {torn}: {remedy}")
            run = msgspec.json.decode(archive.read(RUN_ENTRY), type=Run)
            progress = archive.read(PROGRESS_ENTRY)
            best = archive.read(BEST_ENTRY) if BEST_ENTRY in archive.namelist() else None
    except FileNotFoundError:
        raise RunError(f"{path} is missing: {remedy}") from None
    except (OSError, KeyError, zipfile.BadZipFile, msgspec.DecodeError, ValueError) as error:
        if isinstance(error, RunError):
            raise
        raise RunError(f"{path} is no checkpoint of a training run ({error}): {remedy}") from None
    if run.format != FORMAT:
        raise RunError(f"{path} has format {run.format!r}, this version reads {FORMAT!r}: {remedy}")
    return Checkpoint(run, best, progress)


def unfinished_run(folder: Path, subject: Mapping[str, Any], identity: str | None) -> Checkpoint | None:
    """The run to go on with, from its checkpoint; None if it has to begin.

    Args:
        folder: of the run.
        subject: what the caller's training depends on.
        identity: of the run that the caller goes on with; None: whichever has this subject.

    Raises:
        RunError: the checkpoint belongs to another run, or is damaged, or lost.
    """
    path = folder / CHECKPOINT_FILE
    found = check_checkpoint(folder, identity)
    if found is None:
        return None
    wanted = as_json(subject)
    for name in wanted:
        if found.run.subject.get(name) != wanted[name]:
            raise RunError(
                f"{path} belongs to a training with another {name.replace('_', ' ')}: resume with the "
                "same, or choose another --out"
            )
    return found


def check_checkpoint(folder: Path, identity: str | None) -> Checkpoint | None:
    """What a folder's checkpoint holds; None if the run has not come so far as to write one.

    Raises RunError if it is damaged, lost, or of another run than `identity` (None: any).
    """
    path = folder / CHECKPOINT_FILE
    if not path.exists():
        _check_nothing_lost(folder)
        return None
    found = load_run(path)
    if identity is not None and found.run.run != identity:
        raise RunError(
            f"{path} belongs to the training run {found.run.run}, not to {identity} that the folder was "
            "begun with: give --force to begin anew, or choose another --out"
        )
    return found


def _check_nothing_lost(folder: Path) -> None:
    """Raises RunError if a folder without a checkpoint holds what a run writes with its checkpoint."""
    for name in DERIVED_FILES:
        if (folder / name).exists():
            raise RunError(
                f"{folder} holds {name} but no {CHECKPOINT_FILE}: put the checkpoint back, give --force "
                "to begin anew, or choose another --out"
            )


def as_json(content: Mapping[str, Any]) -> dict[str, Any]:
    """Content as JSON gives it back."""
    return json.loads(json.dumps(content))


def without_nan(rows: list[Row]) -> list[dict[str, float | None]]:
    """Rows as JSON takes them: it has no number for what was not measured."""
    return [{key: None if isnan(value) else value for key, value in row.items()} for row in rows]


def with_nan(rows: list[dict[str, float | None]]) -> list[Row]:
    """The inverse of `without_nan`."""
    return [{key: nan if value is None else value for key, value in row.items()} for row in rows]
