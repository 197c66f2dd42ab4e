"""A short hash that tells whether results are of the controller that runs now."""

import inspect
from pathlib import Path

import joblib

from controllers.base import Controller


def fingerprint(controller: Controller) -> str:
    """A short hash of the controller's settings, weights and module."""
    source = inspect.getsourcefile(type(controller))
    code = Path(source).read_bytes() if source else b""
    return str(joblib.hash((joblib.hash(controller), code)))[:12]
