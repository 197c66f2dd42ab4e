"""The controllers of a sweep by what a user calls them: tuned kinds, and folders of policies."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from controllers.base import Controller
from controllers.learned import LearnedPolicy, load_policy
from controllers.policy_contract import CONTRACT_FILE, WEIGHTS_FILE
from controllers.privileged_pulse import PrivilegedPulse
from controllers.supervised import settings_for, supervised
from controllers.supervisor_settings import SETTINGS
from controllers.tuned import build, load_tunings
from epv_env.plant.plantfile import Plant
from training.studies.fingerprint import fingerprint
from training.studies.imported_controllers import imported_controller, is_import

DEFAULT = ("hysteresis, extrapolating", "pulse", "PWM")
"""Controllers that are swept unless others are named: good ones that compute little."""

INFORMED = PrivilegedPulse.name
"""Knows each valve's parameters, and needs no tuning: a reference, not a rival."""

SUPERVISED = "supervised:"
"""Before the name of a controller: it acts under a supervisor (controllers/supervisor.py)."""

HELP = (
    "tuned kinds, folders of policies, LABEL=FOLDER, or MODULE:CLASS; "
    f"{SUPERVISED}NAME puts one under a supervisor"
)
"""Of the options that take controllers by name."""


def named_controllers(
    sources: Sequence[str], plant: Plant
) -> tuple[dict[str, Controller], dict[str, str]]:
    """Controllers by label, and a digest of what each was made from.

    sources: a tuned kind (controllers/tuned.json), "pulse, informed", a folder that training
    wrote, LABEL=FOLDER, or MODULE:CLASS; or SUPERVISED and one of these.
    plant: that the classic ones are designed for. Raises ValueError.
    """
    controllers: dict[str, Controller] = {}
    digests: dict[str, str] = {}
    for source in sources:
        label, controller, content = _named(source, plant)
        if label in controllers:
            raise ValueError(f"two controllers are called {label!r}: give one as LABEL=FOLDER")
        controllers[label] = controller
        digests[label] = hashlib.sha256(content).hexdigest()
    return controllers, digests


def _named(source: str, plant: Plant) -> tuple[str, Controller, bytes]:
    """Label, controller, and the bytes that define it."""
    if source.startswith(SUPERVISED):
        return _supervised(source.removeprefix(SUPERVISED), plant)
    tunings = load_tunings()
    if source in tunings:
        values = tunings[source].values
        return source, build(source, values, plant), json.dumps(values, sort_keys=True).encode()
    if source == INFORMED:
        return source, build(source, {}, plant), source.encode()
    if is_import(source):
        controller = imported_controller(source)
        return controller.name, controller, fingerprint(controller).encode()
    label, _, folder = source.rpartition("=")
    path = Path(folder)
    if not folder or not path.is_dir():
        raise ValueError(
            f"no controller {source!r}: give a folder that training wrote, MODULE:CLASS, or one of "
            f"{', '.join(tunings)}"
        )
    policy = load_policy(path)
    content = (path / CONTRACT_FILE).read_bytes() + (path / WEIGHTS_FILE).read_bytes()
    return label or policy.name, policy, content


def _supervised(source: str, plant: Plant) -> tuple[str, Controller, bytes]:
    """`_named` under a supervisor, with the settings that lie in the folder if it is one's."""
    label, main, content = _named(source, plant)
    is_policy = isinstance(main, LearnedPolicy)
    settings = settings_for(source.rpartition("=")[-1]) if is_policy else SETTINGS
    digest = json.dumps(asdict(settings), sort_keys=True).encode()
    own = supervised(main, plant, settings)
    return f"{label}, supervised", own, SUPERVISED.encode() + digest + content
