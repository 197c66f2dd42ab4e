"""What the controller sees: the readings of an ECU, normalised. This order is a contract.

Decision 2026-11-21: no true state, parameter or consumption is ever observed; changes over past samples
stand for the rates that an ECU would compute.
"""

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from epv_env.plant.channels import CURRENT, P1, P2, P3

P2_LAGS = (1, 2, 4, 8)
"""Control periods over which changes of the measured p2 are observed."""
P3_LAGS = (1, 4)
"""The same for p3."""
HISTORY = max(*P2_LAGS, *P3_LAGS) + 1
"""Readings of p2 and p3 that are kept, the newest first."""

LONGEST_WAIT = 0.2
"""Time since the last switching at which its observation saturates [s]."""


@dataclass(frozen=True)
class Quantity:
    """One entry of the observation: (value - centre) / scale, clipped to ±limit."""

    name: str
    """Name of the entry; part of the contract."""
    unit: str
    """Unit of `centre` and `scale`; "1" for none."""
    centre: float
    """Value that is encoded as 0 [unit]."""
    scale: float
    """Change that is encoded as 1 [unit]."""
    limit: float
    """Largest magnitude of the encoded value [-]."""


LAYOUT = (
    Quantity("p2_error", P2.unit, 0.0, 0.5, 32.0),
    Quantity("target", P2.unit, 8.0, 4.0, 2.5),
    Quantity("p1", P1.unit, 10.0, 4.0, 2.5),
    Quantity("p3", P3.unit, 8.0, 4.0, 2.5),
    Quantity("I", CURRENT.unit, 0.3, 0.3, 5.0),
    Quantity("action", "1", 0.5, 0.5, 1.0),
    Quantity("since_switching", "s", LONGEST_WAIT / 2, LONGEST_WAIT / 2, 1.0),
    *(Quantity(f"p2_change_{lag}", P2.unit, 0.0, 0.1, 160.0) for lag in P2_LAGS),
    *(Quantity(f"p3_change_{lag}", P3.unit, 0.0, 0.5, 32.0) for lag in P3_LAGS),
)
"""Entries of the observation in their order."""

INDEX = {quantity.name: row for row, quantity in enumerate(LAYOUT)}
"""Row of each entry."""

CENTRE, SCALE, LIMIT = (
    np.array([getattr(quantity, name) for quantity in LAYOUT]) for name in ("centre", "scale", "limit")
)
"""The layout's numbers by row."""


def observation_space() -> gymnasium.spaces.Box:
    """The finite box of one observation, float32."""
    limit = LIMIT.astype(np.float32)
    return gymnasium.spaces.Box(-limit, limit, dtype=np.float32)


def scaled(value, centre, scale, limit):
    """A value as the observation shows it [-]; numbers or arrays. The step compiles this function."""
    return np.minimum(np.maximum((value - centre) / scale, -limit), limit)


def encode(values: dict[str, NDArray]) -> NDArray:
    """Observations (n, entries) float32 [-] from physical values (n,) by entry name [bar, A, s]."""
    columns = np.stack([values[quantity.name] for quantity in LAYOUT], axis=-1)
    return scaled(columns, CENTRE, SCALE, LIMIT).astype(np.float32)


def decode(observations: NDArray, name: str) -> NDArray:
    """One entry of observations (n, entries) [-] in its unit, (n,) [bar, A, s]; KeyError if unknown."""
    row = INDEX[name]
    return observations[..., row] * LAYOUT[row].scale + LAYOUT[row].centre


def contract(control_period: float) -> dict[str, Any]:
    """The layout as data, for a policy that leaves this package: order, units, scaling, period."""
    return {
        "format": "epv-observation/1",
        "control_period_s": control_period,
        "entries": [vars(quantity) for quantity in LAYOUT],
    }
