"""What an action means: how long the coil is on within a control period."""

from dataclasses import dataclass
from typing import ClassVar

import gymnasium
import numpy as np
from numpy.typing import NDArray


class ActionError(ValueError):
    """An action is not one of the action space."""


@dataclass(frozen=True)
class OnOff:
    """Discrete(2): the coil is off (0, the PV opens) or on (1, it shuts) for the whole period."""

    default_period: ClassVar[float] = 5e-3
    """Control period where none is given [s]."""
    period: float
    """Control period [s]."""

    def space(self) -> gymnasium.Space:
        """Of one action."""
        return gymnasium.spaces.Discrete(2)

    def decode(self, actions: NDArray) -> tuple[NDArray, NDArray]:
        """Time on [s] and commanded fraction for actions (n,)."""
        on = np.asarray(actions).reshape(len(actions)) == 1
        if not np.all(on | (np.asarray(actions).reshape(len(actions)) == 0)):
            raise ActionError(f"actions {actions!r} are not all 0 (coil off) or 1 (coil on)")
        return np.where(on, self.period, 0.0), on.astype(float)


@dataclass(frozen=True)
class PWM:
    """Box [-1, 1]: duty = (action + 1) / 2 is the share of the period, from its start, with the coil on.

    Symmetric because that is what learning libraries ask of a Box.
    """

    default_period: ClassVar[float] = 20e-3
    """PWM period where none is given [s]."""
    resolution: ClassVar[float] = 0.5e-3
    """Duty is realised in steps of this time [s]."""
    period: float
    """PWM period [s]."""

    def space(self) -> gymnasium.Space:
        """Of one action."""
        return gymnasium.spaces.Box(-1.0, 1.0, (1,), dtype=np.float32)

    def decode(self, actions: NDArray) -> tuple[NDArray, NDArray]:
        """Time on [s] and realised fraction for actions (n, 1)."""
        if not np.all(np.isfinite(actions)):
            raise ActionError(f"actions {actions!r} are not all finite: give numbers in [-1, 1]")
        duty = np.clip((np.asarray(actions, float).reshape(len(actions)) + 1) / 2, 0.0, 1.0)
        slots = max(round(self.period / self.resolution), 1)
        duty = np.rint(duty * slots) / slots
        return np.where(duty >= 1.0, self.period, duty * self.period), duty
