"""A short hash that tells whether results are of the controller that runs now."""

import io
import pickle
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import joblib

import controllers
from controllers.base import Controller


def fingerprint(controller: Controller) -> str:
    """A short hash of the controller's settings, weights and code.

    The code is that of the modules in which the controller and its parts are defined, and of those that
    these take something from: within the controller's own package, and within `controllers`.
    """
    code = [Path(source).read_bytes() for source in sorted(_sources(controller))]
    return str(joblib.hash((joblib.hash(controller), code)))[:12]


def _sources(controller: Controller) -> set[str]:
    """Files of the modules that the controller consists of."""
    packages = {controllers.__name__, _package(type(controller).__module__)}
    waiting = {each.__module__ for each in _classes(controller)}
    modules: dict[str, ModuleType] = {}
    while waiting:
        name = waiting.pop()
        if name not in modules and _package(name) in packages:
            modules[name] = sys.modules[name]
            named = (getattr(each, "__module__", None) for each in vars(modules[name]).values())
            waiting |= {each for each in named if isinstance(each, str)}
    files = (getattr(module, "__file__", None) for module in modules.values())
    return {file for file in files if file is not None}


def _package(module: str) -> str:
    return module.partition(".")[0]


def _classes(controller: Controller) -> set[type]:
    """The classes of the controller and of all objects within it."""
    found: set[type] = set()

    class Visitor(pickle.Pickler):
        def reducer_override(self, obj: Any) -> Any:
            found.add(obj if isinstance(obj, type) else type(obj))
            return NotImplemented

    Visitor(io.BytesIO()).dump(controller)
    return found
