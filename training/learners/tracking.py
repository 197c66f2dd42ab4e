"""Weights & Biases as an option: a run there shows what a training writes for TensorBoard."""

import importlib
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PROJECT = "epv-valve"
"""Project of the runs, unless the environment variable WANDB_PROJECT names another."""

HELP = "show the training on Weights & Biases, too (needs the package wandb)"
"""Of the option --track."""


def check_tracking(wanted: bool) -> None:
    """Raises ValueError, before any work, if runs are to be tracked and the package is missing."""
    if wanted:
        _package()


@contextmanager
def tracked(wanted: bool, *, name: str, folder: Path, config: Mapping[str, Any]) -> Iterator[None]:
    """Within, TensorBoard events that are written also go to a run of Weights & Biases.

    Args:
        wanted: whether to do so at all.
        name: of the run.
        folder: of the package's own files.
        config: what the run depends on, ready for JSON.

    Raises:
        ValueError: the package is missing, or the service cannot be used.
    """
    if not wanted:
        yield
        return
    package = _package()
    folder.mkdir(parents=True, exist_ok=True)
    settings = {} if "WANDB_PROJECT" in os.environ else {"project": PROJECT}
    package.tensorboard.patch(root_logdir=str(folder))
    try:
        with _begun(package, name=name, dir=str(folder), config=dict(config), **settings):
            yield
    finally:
        package.tensorboard.unpatch()  # the next run has its own folder


def _begun(package: Any, **settings: Any) -> Any:
    """A run that has begun. Raises ValueError if the service cannot be used."""
    try:
        return package.init(**settings)
    except package.Error as error:
        raise ValueError(
            f"--track cannot begin a run of Weights & Biases ({error}): call `wandb login`, or set "
            "WANDB_MODE=offline"
        ) from None


def _package() -> Any:
    """The package wandb. Raises ValueError if it is missing."""
    try:
        return importlib.import_module("wandb")
    except ModuleNotFoundError:
        raise ValueError(
            "--track needs the package wandb, which is not installed: pip install wandb"
        ) from None
