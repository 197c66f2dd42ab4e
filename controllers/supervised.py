"""A policy under its supervisor, from a folder: the supervisor's settings lie beside the weights.

The supervisor believes p3, so it comes with a check of that sensor: once p3 is implausible, a controller
takes over that does not read it.
"""

from dataclasses import asdict, dataclass, field, fields
from os import PathLike
from pathlib import Path
from typing import Any

import msgspec

from controllers.base import Controller
from controllers.hysteresis import EXTRAPOLATING_HYSTERESIS
from controllers.learned import load_policy
from controllers.p3_check import P3Check
from controllers.pulse_simulation import nominal_table
from controllers.supervisor import Supervisor
from controllers.supervisor_settings import SETTINGS, SupervisorSettings
from controllers.tuned import build, load_tunings
from epv_env.common.files import checked, read_json, write_json
from epv_env.plant.plantfile import Plant

FORMAT = "epv-supervisor/4"
SUPERVISOR_FILE = "supervisor.json"
FALLBACK = EXTRAPOLATING_HYSTERESIS.kind
"""Takes over where p3 is implausible: the best of those that do not read it."""


class SupervisorFileError(ValueError):
    """A file of a supervisor's settings cannot be used: the message says why and what to do."""


@dataclass(frozen=True, kw_only=True)
class SupervisorFile:
    """The content of a file of a supervisor's settings."""

    settings: SupervisorSettings
    """What the search settled, and what it left as it is."""
    search: dict[str, Any] = field(default_factory=dict)
    """How it searched."""


def supervised(controller: Controller, plant: Plant, settings: SupervisorSettings = SETTINGS) -> P3Check:
    """A controller for the on/off environment under a supervisor that knows this nominal plant.

    Raises ValueError for a controller with other actions, and for one that reads no sensor.
    """
    supervisor = Supervisor(main=controller, table=nominal_table(plant), settings=settings)
    return p3_checked(supervisor, plant, name=supervisor.name)


def p3_checked(controller: Controller, plant: Plant, *, name: str = "") -> P3Check:
    """The controller with a check of p3, the best controller that does not read p3 behind it.

    One that checks p3 already stays as it is.

    name: of both together; default: that of `P3Check`.

    Raises ValueError for a controller with other actions, and for one that reads no sensor.
    """
    if isinstance(controller, P3Check):
        return controller
    fallback = build(FALLBACK, load_tunings()[FALLBACK].values, plant)
    return P3Check(main=controller, fallback=fallback, name=name)


def load_supervised(folder: str | PathLike[str], plant: Plant | None = None) -> P3Check:
    """The policy of a folder under its supervisor; the default settings if the folder has none.

    Args:
        folder: with policy.json, policy.safetensors, and perhaps supervisor.json.
        plant: nominal plant; None: the report's calibration.

    Raises PolicyError or SupervisorFileError if a file cannot be used.
    """
    return supervised(load_policy(folder), plant or Plant.calibrated(), settings_for(folder))


def settings_for(folder: str | PathLike[str]) -> SupervisorSettings:
    """The settings for a folder's policy: its own, or the default. Raises SupervisorFileError."""
    found = load_settings(folder)
    return SETTINGS if found is None else found.settings


def load_settings(folder: str | PathLike[str]) -> SupervisorFile | None:
    """A folder's settings of a supervisor; None if it has no such file. Raises SupervisorFileError."""
    path = Path(folder) / SUPERVISOR_FILE
    if not path.exists():
        return None
    remedy = "correct the file, train the policy anew, or remove the file for the default settings"
    try:
        found = read_json(path, _Stored, version=FORMAT, remedy=remedy)
        known = {each.name for each in fields(SupervisorSettings)}
        for name in sorted(found.settings.keys() - known):
            raise ValueError(f"{path}, settings: {name!r} is no setting: {remedy}")
        for name in sorted(known - found.settings.keys()):
            raise ValueError(f"{path}, settings: {name!r} is missing: {remedy}")
        settings = checked(found.settings, SupervisorSettings, where=f"{path}, settings", remedy=remedy)
    except ValueError as error:
        raise SupervisorFileError(str(error)) from None
    return SupervisorFile(settings=settings, search=found.search)


class _Stored(msgspec.Struct, kw_only=True):
    """`SupervisorFile` before its names are checked: a misspelt setting must not get its default."""

    settings: dict[str, Any]
    search: dict[str, Any] = {}


def save_settings(content: SupervisorFile, folder: str | PathLike[str]) -> None:
    """Write a supervisor's settings into a policy's folder, whole or not at all."""
    write_json(Path(folder) / SUPERVISOR_FILE, {"format": FORMAT, **asdict(content)}, allow_nan=False)
