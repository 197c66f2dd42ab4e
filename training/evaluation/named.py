"""Controllers by what a user calls them: registered kinds, folders of policies, classes of one's own."""

import importlib
import inspect
import json
import os
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from controllers.base import Controller
from controllers.knowledge import WITH_RULES
from controllers.policy import TRAINED, load_policy
from controllers.policy_files import policy_digest
from controllers.registry import REGISTRY, TUNED_KINDS
from controllers.tuned import build, load_tunings
from epv_env import MAX_EPISODE_STEPS
from epv_env.common.field_types import shown
from epv_env.common.files import digest
from epv_env.plant.plantfile import Plant

SHIPPED = "PPO"
"""The policy that comes with the package."""
UNTUNED = tuple(entry.kind for entry in REGISTRY if entry.search_space is None)
"""Kinds that have nothing to tune, because they see what no control unit measures."""
HELP = (
    f"{', '.join((SHIPPED, *TUNED_KINDS, *UNTUNED))}, a folder that training wrote, LABEL=FOLDER, or "
    "MODULE:CLASS of your own"
)
"""What names a controller, for the help of options and for messages."""
PROTOCOL = ("name", "environment", "reset", "act")
"""What a controller has."""


def named_controllers(
    sources: Sequence[str], plant: Plant
) -> tuple[dict[str, Controller], dict[str, str]]:
    """Controllers by label, and a digest of what each was made from.

    Args:
        sources: as HELP says; a tuned kind may be followed by WITH_RULES.
        plant: that the classic ones are designed for.

    Raises:
        ValueError: there is no such controller, or two have the same label.
    """
    controllers: dict[str, Controller] = {}
    digests: dict[str, str] = {}
    for source in sources:
        label, controller, defined = _named(source, plant)
        if label in controllers:
            raise ValueError(f"two controllers are called {label!r}: give one as LABEL=FOLDER")
        controllers[label] = controller
        digests[label] = defined
    return controllers, digests


def _named(source: str, plant: Plant) -> tuple[str, Controller, str]:
    """Label, controller, and a digest of what defines it."""
    tunings, kind = load_tunings(), source.removesuffix(WITH_RULES)
    if kind in tunings or source in UNTUNED:
        values = tunings[kind].values if kind in tunings else {}
        return source, build(source, values, plant), digest(json.dumps(values, sort_keys=True).encode())
    if is_import(source):
        return _imported(source)
    label, _, folder = source.rpartition("=")
    path = TRAINED if source == SHIPPED else Path(folder)
    if not folder or not path.is_dir():
        raise ValueError(f"no controller {source!r}: give {HELP}")
    policy = load_policy(path, plant)
    return label or policy.name, policy, policy_digest(path)


def is_import(source: str) -> bool:
    """Whether a controller's name has the form MODULE:CLASS."""
    module, colon, name = source.partition(":")
    return bool(colon) and all(part.isidentifier() for part in module.split(".")) and name.isidentifier()


def _imported(source: str) -> tuple[str, Controller, str]:
    """The controller that MODULE:CLASS names, made without arguments, and its module's digest.

    Raises ValueError if the module or the class is missing, fails, needs arguments, or is no controller.
    """
    module_name, _, class_name = source.partition(":")
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    remedy = "correct the module"
    try:
        module = importlib.import_module(module_name)
        found, remedy = getattr(module, class_name, None), "give every argument a default value"
        controller: Any = found() if inspect.isclass(found) else None
    except Exception as error:  # whatever the user's own code raises
        if isinstance(error, ModuleNotFoundError):
            remedy = f"give MODULE:CLASS of a module in {os.getcwd()} or installed"
        last = traceback.extract_tb(error.__traceback__)[-1]
        own = last.filename != __file__ and os.path.exists(last.filename)
        place = f" ({last.filename}, line {last.lineno})" if own else ""
        text = f"{type(error).__name__}: {' '.join(str(error).split())}{place}"
        raise ValueError(f"controller {source}: {text}: {remedy}") from error
    if controller is None:
        raise ValueError(f"controller {source}: module {module_name} has no class {class_name}")
    if lacking := [name for name in PROTOCOL if not hasattr(controller, name)]:
        raise ValueError(
            f"controller {source} lacks {', '.join(lacking)}: controllers/base.py has the protocol"
        )
    if controller.environment not in MAX_EPISODE_STEPS or not isinstance(controller.name, str):
        raise ValueError(
            f"controller {source} is called {shown(controller.name)} and acts in the environment "
            f"{shown(controller.environment)}: give a text and one of {', '.join(MAX_EPISODE_STEPS)}"
        )
    return controller.name, controller, digest(inspect.getsource(module).encode())
