"""A controller of one's own, as docs/extending.md explains: a relay with a hold time."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from epv_env.observation import decode


@dataclass(kw_only=True)
class Relay:
    """Opens the valve below one error of p2, and holds each decision for some periods."""

    low: float = -0.1
    """The valve opens below this p2 - target [bar]."""
    hold: int = 2
    """Periods for which a decision stands."""
    name: str = "relay"
    environment: str = "EPValve-v0"
    _left: NDArray = field(default_factory=lambda: np.zeros(0, dtype=int))
    _action: NDArray = field(default_factory=lambda: np.zeros(0, dtype=int))

    def reset(self, n: int) -> None:
        """Forget everything; n episodes begin."""
        self._left = np.zeros(n, dtype=int)
        self._action = np.ones(n, dtype=int)

    def act(self, observations: NDArray) -> NDArray:
        """Coil off (0) or on (1) for observations (n, entries), as (n,)."""
        wanted = (decode(observations, "p2_error") > self.low).astype(int)
        self._action = np.where(self._left > 0, self._action, wanted)
        self._left = np.where(self._left > 0, self._left - 1, self.hold)
        return self._action
