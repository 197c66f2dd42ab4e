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
from epv_env.plant.primitives import exact

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

ENTRIES = len(LAYOUT)
"""Of an observation."""

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


READINGS = np.dtype(
    (
        np.record,
        [
            ("error", np.float64),  # p2 - target [bar]
            ("target", np.float64),  # [bar absolute]
            ("p1", np.float64),  # [bar absolute]
            ("p2", np.float64),  # [bar absolute]
            ("p3", np.float64),  # [bar absolute]
            ("current", np.float64),  # [A]
            ("coil", np.float64),  # share of the last period for which it was on [1]
            ("waited", np.float64),  # since the last switching, at most LONGEST_WAIT [s]
            ("p2_change", np.float64, (len(P2_LAGS),)),  # over P2_LAGS periods [bar]
            ("p3_change", np.float64, (len(P3_LAGS),)),  # over P3_LAGS periods [bar]
        ],
    )
)
"""Record of what a control unit knows of one valve: an observation in its units."""


@exact
def scaled(value, centre, scale, limit):
    """A value as the observation shows it [-]; numbers or arrays."""
    return np.minimum(np.maximum((value - centre) / scale, -limit), limit)


def encode(values: dict[str, NDArray]) -> NDArray:
    """Observations (n, entries) float32 [-] from physical values (n,) by entry name [bar, A, s]."""
    columns = np.stack([values[quantity.name] for quantity in LAYOUT], axis=-1)
    return scaled(columns, CENTRE, SCALE, LIMIT).astype(np.float32)


def decode(observations: NDArray, name: str) -> NDArray:
    """One entry of observations (n, entries) [-] in its unit, (n,) [bar, A, s]; KeyError if unknown."""
    row = INDEX[name]
    return observations[..., row] * LAYOUT[row].scale + LAYOUT[row].centre


_ERROR, _TARGET, _P1, _P3, _I, _COIL, _WAITED, _P2_CHANGE, _P3_CHANGE = (
    INDEX[name]
    for name in (
        "p2_error", "target", "p1", "p3", "I", "action", "since_switching", "p2_change_1", "p3_change_1",
    )
)  # fmt: skip


@exact
def _entry(value, k):
    """Entry k of an observation [-] from its value in its unit."""
    return scaled(value, CENTRE[k], SCALE[k], LIMIT[k])


@exact
def write(row, past, p1, current, target, coil, waited):
    """Write an observation (entries,) [-]; the values as READINGS has them.

    past: record with the readings of p2 and p3, p2_history and p3_history (HISTORY,), the newest first.
    """
    row[_ERROR] = _entry(past.p2_history[0] - target, _ERROR)
    row[_TARGET] = _entry(target, _TARGET)
    row[_P1] = _entry(p1, _P1)
    row[_P3] = _entry(past.p3_history[0], _P3)
    row[_I] = _entry(current, _I)
    row[_COIL] = _entry(coil, _COIL)
    row[_WAITED] = _entry(waited, _WAITED)
    for k in range(len(P2_LAGS)):
        row[_P2_CHANGE + k] = _entry(past.p2_history[0] - past.p2_history[P2_LAGS[k]], _P2_CHANGE + k)
    for k in range(len(P3_LAGS)):
        row[_P3_CHANGE + k] = _entry(past.p3_history[0] - past.p3_history[P3_LAGS[k]], _P3_CHANGE + k)


@exact
def _value(row, k):
    """Entry k of an observation (entries,) in its unit."""
    return row[k] * SCALE[k] + CENTRE[k]


@exact
def read(r, row):
    """Read an observation (entries,) [-] into a record of READINGS."""
    r.error = _value(row, _ERROR)
    r.target = _value(row, _TARGET)
    r.p1 = _value(row, _P1)
    r.p2 = r.error + r.target
    r.p3 = _value(row, _P3)
    r.current = _value(row, _I)
    r.coil = _value(row, _COIL)
    r.waited = _value(row, _WAITED)
    for k in range(len(P2_LAGS)):
        r.p2_change[k] = _value(row, _P2_CHANGE + k)
    for k in range(len(P3_LAGS)):
        r.p3_change[k] = _value(row, _P3_CHANGE + k)


def contract(control_period: float) -> dict[str, Any]:
    """The layout as data, for a policy that leaves this package: order, units, scaling, period."""
    return {
        "format": "epv-observation/1",
        "control_period_s": control_period,
        "entries": [vars(quantity) for quantity in LAYOUT],
    }
