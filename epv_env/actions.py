"""What an action means: how long the coil is on within a control period."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import gymnasium
import numba
import numpy as np
from numpy.typing import NDArray

from epv_env.common.field_types import shown
from epv_env.plant.primitives import ROUNDING, exact


class ActionError(ValueError):
    """An action is not one of the action space."""


@exact
def on_off(action, period, slots):
    """Time on [s] and commanded fraction [-] of one action, and whether it is 0 or 1."""
    return period if action == 1.0 else 0.0, action, (action == 0.0) | (action == 1.0)


@exact
def modulated(action, period, slots):
    """Time on [s] and duty [-], in whole slots, of one action, and whether it is finite."""
    asked = min(max((action + 1.0) / 2.0, 0.0), 1.0)
    duty = ((asked * slots + ROUNDING) - ROUNDING) / slots
    return period if duty >= 1.0 else duty * period, duty, math.isfinite(action)


@dataclass(frozen=True)
class OnOff:
    """Discrete(2): the coil is off (0, the PV opens) or on (1, it shuts) for the whole period."""

    rule: ClassVar = staticmethod(on_off)
    """What one action means; an accelerator compiles it, too."""
    slots: ClassVar[int] = 1
    """Shares of the period that can be asked for, less one."""
    default_period: ClassVar[float] = 5e-3
    """Control period where none is given [s]."""
    period: float
    """Control period [s]."""

    def space(self) -> gymnasium.Space:
        """Of one action."""
        return gymnasium.spaces.Discrete(2)

    def decode(self, actions: Any) -> tuple[NDArray, NDArray]:
        """Time on [s] and commanded fraction for actions (n,)."""
        on_time, on, valid = _on_off(_numbers(actions), self.period)
        if not valid:
            raise ActionError(f"actions {shown(actions)} are not all 0 (coil off) or 1 (coil on)")
        return on_time, on


@dataclass(frozen=True)
class PWM:
    """Box [-1, 1]: duty = (action + 1) / 2 is the share of the period, from its start, with the coil on.

    Symmetric because that is what learning libraries ask of a Box.
    """

    rule: ClassVar = staticmethod(modulated)
    """What one action means; an accelerator compiles it, too."""
    default_period: ClassVar[float] = 20e-3
    """PWM period where none is given [s]."""
    resolution: ClassVar[float] = 0.5e-3
    """Duty is realised in steps of this time [s]."""
    period: float
    """PWM period [s]."""

    @property
    def slots(self) -> int:
        """Steps of the duty in a period."""
        return max(round(self.period / self.resolution), 1)

    def space(self) -> gymnasium.Space:
        """Of one action."""
        return gymnasium.spaces.Box(-1.0, 1.0, (1,), dtype=np.float32)

    def decode(self, actions: Any) -> tuple[NDArray, NDArray]:
        """Time on [s] and realised fraction for actions (n, 1)."""
        on_time, duty, valid = _modulated(_numbers(actions), self.period, self.slots)
        if not valid:
            raise ActionError(f"actions {shown(actions)} are not all finite: give numbers in [-1, 1]")
        return on_time, duty


def _check_unmasked(actions: Any) -> None:
    """Raises ActionError for a mask: NumPy would drop it, and keep what is under it."""
    parts = actions if isinstance(actions, (list, tuple)) else [actions]
    if any(map(np.ma.isMaskedArray, parts)):
        raise ActionError(f"actions {shown(actions)}: give one number for each valve, no mask")


def as_array(actions: Any) -> NDArray:
    """Actions as an array, an empty one if they make none. Raises ActionError."""
    _check_unmasked(actions)
    try:
        return np.asarray(actions)
    except (TypeError, ValueError):  # bfloat16, or of several lengths
        return np.empty(0, dtype=object)


def _numbers(actions: Any) -> NDArray:
    """Actions (n,) or (n, 1) of any real type as float64, (n,). Raises ActionError."""
    array = as_array(actions)
    if not (array.dtype.kind in "biuf" and array.ndim in (1, 2) and array.size == len(array)):
        raise ActionError(f"actions {shown(actions)}: give one number for each valve")
    return array.astype(np.float64).reshape(len(array))


@numba.njit(cache=True)
def _on_off(actions: NDArray, period: float) -> tuple[NDArray, NDArray, bool]:
    """`on_off` of all actions (n,): times on (n,) [s], fractions (n,) [-], whether all are valid."""
    on_time, valid = np.empty(len(actions)), True
    for i in range(len(actions)):
        on_time[i], _, good = on_off(actions[i], period, 1)
        valid &= good
    return on_time, actions, valid


@numba.njit(cache=True)
def _modulated(actions: NDArray, period: float, slots: int) -> tuple[NDArray, NDArray, bool]:
    """`modulated` of all actions (n,): times on (n,) [s], duties (n,) [-], whether all are valid."""
    on_time, duty, valid = np.empty(len(actions)), np.empty(len(actions)), True
    for i in range(len(actions)):
        on_time[i], duty[i], good = modulated(actions[i], period, slots)
        valid &= good
    return on_time, duty, valid
