"""What a monitor knows of the nominal plant and of the catalogue, as a file."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from epv_env.common.files import JSONFileError, read_json, write_json
from identification.monitor.features import CONDITIONS, FEATURES

FORMAT = "epv-monitor/3"
REMEDY = "make the model anew with training.monitoring.monitor_model"
SHIPPED = Path(__file__).with_name("monitor.json")
"""The model of a monitor for the report's valve; `python -m training.monitoring` makes it."""

UNKNOWN = "unknown"
"""Name of a change that no effect of the catalogue explains."""
RETURN = "return"
"""Name of a change that takes back the latest one: a repair, a supply that is restored."""
SMALLEST, LARGEST = 1e-9, 1e9
"""Least scale, and greatest magnitude, of a model's numbers: no simulation gives others."""

QUADRATIC = 5
"""Conditions from the first on, whose products count, too."""
OPEN, KINKS = CONDITIONS.index("open"), (-0.5, 0.5, 1.5, 2.5)
"""Times open at which the dependence on it changes: readings are few in a short opening [periods]."""
TERMS = 1 + len(CONDITIONS) + QUADRATIC * (QUADRATIC + 1) // 2 + len(KINKS)
LINEAR = 1 + QUADRATIC
"""Terms on which the nominal plant's features depend, and the first of them: those of a shift."""


@dataclass(frozen=True)
class MonitorModel:
    """What the monitor knows of the nominal plant and the catalogue, in whitened features."""

    centre: NDArray
    """Typical conditions (conditions,)."""
    scale: NDArray
    """Their spread (conditions,)."""
    whiten: NDArray
    """From features to whitened ones (features, features)."""
    expected: NDArray
    """Whitened features of the nominal plant by terms of the conditions (features, terms)."""
    effects: tuple[str, ...]
    """Effect of each shift."""
    components: tuple[str, ...]
    """Component of each shift."""
    shifts: NDArray
    """Shift of the whitened features (shifts, features, LINEAR)."""

    def save(self, path: str | PathLike[str]) -> None:
        """Write a JSON file."""
        fields = {n: v.tolist() if isinstance(v, np.ndarray) else v for n, v in vars(self).items()}
        write_json(path, {"format": FORMAT, **fields})

    @classmethod
    def load(cls, path: str | PathLike[str]) -> "MonitorModel":
        """Read it. Raises JSONFileError."""
        found = read_json(path, _File, version=FORMAT, remedy=REMEDY)
        lists = msgspec.structs.asdict(found).items()
        try:
            values: dict[str, Any] = {name: np.array(value) for name, value in lists}
            values |= {"effects": tuple(found.effects), "components": tuple(found.components)}
            return cls(**values)
        except ValueError as error:
            raise JSONFileError(f"{path}: {error}: {REMEDY}") from None

    def __post_init__(self) -> None:
        """Raises ValueError for arrays that do not fit together, impossible numbers, and names."""
        n, effects = len(FEATURES), len(self.effects)
        shapes = {
            "centre": (len(CONDITIONS),), "scale": (len(CONDITIONS),), "whiten": (n, n),
            "expected": (n, TERMS), "shifts": (effects, n, LINEAR),
        }  # fmt: skip
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise ValueError(f"{name} has the shape {getattr(self, name).shape}, not {shape}")
            low, values = SMALLEST if name == "scale" else -LARGEST, getattr(self, name)
            if wrong := values[~((values >= low) & (values <= LARGEST))].tolist():
                raise ValueError(f"{name} holds {wrong[0]:g}, not a number from {low:g} to {LARGEST:g}")
        if len(self.components) != effects:
            raise ValueError(f"{len(self.components)} components for {effects} effects")
        for name in (*self.effects, *self.components):
            if not (name.isascii() and name.isidentifier()) or name in (UNKNOWN, RETURN):
                raise ValueError(f"{name[:40]!r} is no name: give one of letters, digits and _")


class _File(msgspec.Struct):
    centre: list[float]
    scale: list[float]
    whiten: list[list[float]]
    expected: list[list[float]]
    effects: list[str]
    components: list[str]
    shifts: list[list[list[float]]]


def polynomial(conditions: NDArray, centre: NDArray, scale: NDArray) -> NDArray:
    """1, scaled conditions, products of the first QUADRATIC, and what `open` exceeds the KINKS by.

    conditions: (openings, conditions) or (conditions,). Returns (openings, TERMS) or (TERMS,) [-].
    """
    x = (conditions - centre) / scale
    rows, columns = np.triu_indices(QUADRATIC)
    kinks = np.maximum(conditions[..., OPEN, None] - np.array(KINKS), 0.0)
    return np.concatenate([np.ones_like(x[..., :1]), x, x[..., rows] * x[..., columns], kinks], axis=-1)
