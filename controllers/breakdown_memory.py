"""How far p2 has broken down lately: a near miss shows that applications are harder than usual."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.reward import BAND_BAR

REACHED = 0.05
"""Distance below the target from which the target counts as reached [bar]."""


class BreakdownMemory:
    """Remembers the largest shortfall of each circuit, and forgets it slowly.

    The way up to the target is no breakdown: what counts begins once the target has been reached, and
    again after the supply failed.
    """

    def __init__(self, *, memory_time: float, control_period: float):
        """
        Args:
            memory_time: time in which the memory of a shortfall fades by 1/e [s].
            control_period: [s].
        """
        self._fading = np.exp(-control_period / memory_time)
        self.reset(0)

    def reset(self, n: int) -> None:
        """Forget everything; n episodes begin."""
        self._deepest = np.zeros(n)
        self._reached = np.zeros(n, dtype=bool)

    def forget(self, who: NDArray) -> None:
        """Forget the circuits with these indices (m,), whose episodes have ended."""
        self._deepest[who], self._reached[who] = 0.0, False

    def arrays(self) -> Iterator[tuple[str, Any, str]]:
        """Name, owner and attribute of each array (n,) that is kept between control periods."""
        yield "deepest", self, "_deepest"
        yield "reached", self, "_reached"

    def observe(self, error: NDArray, fed: NDArray) -> NDArray:
        """Take in p2 - target (n,) [bar]; the largest shortfall lately (n,) [bar], at most the band's.

        fed: whether the supply can raise the circuit (n,), bool.
        """
        self._reached = (self._reached | (error > -REACHED)) & fed
        shortfall = np.where(self._reached, np.clip(-error, 0.0, BAND_BAR), 0.0)
        self._deepest = np.maximum(self._deepest * self._fading, shortfall)
        return self._deepest
