"""Provenance of a training: all that is needed to repeat it."""

import platform
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from epv_env.plant.plantfile import Plant
from training.learners.hyperparameters import Hyperparameters

PACKAGES = ("gymnasium", "numba", "numpy", "stable-baselines3", "torch")
"""Packages whose versions a training depends on."""


def configuration(
    options: Mapping[str, Any], plant: Plant, hyperparameters: Hyperparameters
) -> dict[str, Any]:
    """Options of the command line, hyperparameters, plant and versions, ready for JSON."""
    return {
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
