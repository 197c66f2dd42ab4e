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
from typing import Any

import msgspec

from epv_env.common.files import write_bytes

FORMAT = "epv-training-run/1"
CHECKPOINT_FILE = "checkpoint.zip"
RUN_ENTRY, BEST_ENTRY = "run.json", "best.zip"
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


def save_run(path: Path, run: Run, *, model: bytes, best: bytes | None) -> None:
    """Write the state of a run, whole or not at all.

    Args:
        path: of the checkpoint.
        run: what was done.
        model: stable-baselines3's archive of the model.
        best: the same of the best validated model; None: none was validated.
    """
    stream = io.BytesIO(model)
    with zipfile.ZipFile(stream, "a") as archive:
        archive.writestr(RUN_ENTRY, msgspec.json.encode(run))
        if best is not None:
            archive.writestr(BEST_ENTRY, best)
    write_bytes(path, stream.getvalue())


def load_run(path: Path) -> tuple[Run, bytes | None]:
    """What a checkpoint's run has done, and the archive of its best model if one was validated.

    Raises RunError if the checkpoint is missing, damaged, or of another version.
    """
    remedy = "give --force to begin anew, or choose another --out"
    try:
        with zipfile.ZipFile(path) as archive:
            if (torn := archive.testzip()) is not None:
                raise RunError(f"{path} is damaged in its entry {torn}: {remedy}")
            run = msgspec.json.decode(archive.read(RUN_ENTRY), type=Run)
            best = archive.read(BEST_ENTRY) if BEST_ENTRY in archive.namelist() else None
    except FileNotFoundError:
        raise RunError(f"{path} is missing: {remedy}") from None
    except (OSError, KeyError, zipfile.BadZipFile, msgspec.DecodeError, ValueError) as error:
        if isinstance(error, RunError):
            raise
        raise RunError(f"{path} is no checkpoint of a training run ({error}): {remedy}") from None
    if run.format != FORMAT:
        raise RunError(f"{path} has format {run.format!r}, this version reads {FORMAT!r}: {remedy}")
    return run, best


def unfinished_run(
    folder: Path, subject: Mapping[str, Any], identity: str | None
) -> tuple[Run, bytes | None] | None:
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
    run, best = found
    wanted = as_json(subject)
    for name in wanted:
        if run.subject.get(name) != wanted[name]:
            raise RunError(
                f"{path} belongs to a training with another {name.replace('_', ' ')}: resume with the "
                "same, or choose another --out"
            )
    return run, best


def check_checkpoint(folder: Path, identity: str | None) -> tuple[Run, bytes | None] | None:
    """What a folder's checkpoint holds; None if the run has not come so far as to write one.

    Raises RunError if it is damaged, lost, or of another run than `identity` (None: any).
    """
    path = folder / CHECKPOINT_FILE
    if not path.exists():
        _check_nothing_lost(folder)
        return None
    run, best = load_run(path)
    if identity is not None and run.run != identity:
        raise RunError(
            f"{path} belongs to the training run {run.run}, not to {identity} that the folder was begun "
            "with: give --force to begin anew, or choose another --out"
        )
    return run, best


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
