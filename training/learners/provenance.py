"""Provenance of a training: all that is needed to repeat it."""

import hashlib
import platform
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypedDict

from epv_env.plant.plantfile import Plant
from training.learners.hyperparameters import Hyperparameters

PACKAGES = ("gymnasium", "numba", "numpy", "stable-baselines3", "torch")
"""Packages whose versions a training depends on."""


class Configuration(TypedDict):
    """What a resumed training reads of its configuration."""

    run: str
    """Identity of the run."""
    options: dict[str, Any]
    """Of the command line, by name."""


def plant_digest(plant: Plant) -> str:
    """SHA-256 of a plant's parameters and region: the same for the same numbers, whatever the file."""
    region = plant.region
    described = repr([*plant.parameters.items(), region.boxes, region.symbols, region.chi_square])
    described += "" if region.covariance is None else repr(region.covariance.tolist())
    return hashlib.sha256(described.encode()).hexdigest()


def configuration(
    options: Mapping[str, Any], plant: Plant, hyperparameters: Hyperparameters, *, run: str
) -> dict[str, Any]:
    """Run, options of the command line, hyperparameters, plant and versions, ready for JSON."""
    return {
        "run": run,
        "options": {name: str(v) if isinstance(v, Path) else v for name, v in options.items()},
        "hyperparameters": asdict(hyperparameters),
        "plant": {
            "name": plant.name,
            "parameters": dict(plant.parameters),
            "provenance": plant.provenance,
        },
        "versions": {"python": platform.python_version(), **{p: version(p) for p in PACKAGES}},
        "written": datetime.now(UTC).isoformat(timespec="seconds"),
    }
