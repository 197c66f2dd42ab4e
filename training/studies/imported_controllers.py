"""Controllers of one's own on command lines: MODULE:CLASS, from the working folder or installed."""

import importlib
import inspect
import os
import sys
from typing import Any

from controllers.base import Controller

HELP = "controllers of your own: MODULE:CLASS, in the working folder or installed"
"""Of the options that take them."""


def is_import(source: str) -> bool:
    """Whether a controller's name has the form MODULE:CLASS."""
    module, colon, name = source.partition(":")
    return bool(colon) and all(part.isidentifier() for part in module.split(".")) and name.isidentifier()


def imported_controller(source: str) -> Controller:
    """The controller that MODULE:CLASS names, made without arguments.

    Raises ValueError if the module or the class is missing, needs arguments, or is no controller
    (controllers.base).
    """
    module_name, _, class_name = source.partition(":")
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        raise ValueError(
            f"controller {source}: {error}: give MODULE:CLASS of a module in {os.getcwd()} or installed"
        ) from None
    found = getattr(module, class_name, None)
    if not inspect.isclass(found):
        raise ValueError(f"controller {source}: {module.__file__} has no class {class_name}")
    try:
        controller: Any = found()
    except TypeError as error:
        raise ValueError(f"controller {source}: {error}: give every argument a default value") from None
    lacking = [name for name in ("name", "environment", "reset", "act") if not hasattr(controller, name)]
    if lacking:
        raise ValueError(
            f"controller {source} lacks {', '.join(lacking)}: controllers/base.py has the protocol"
        )
    return controller
