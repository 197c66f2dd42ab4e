"""Two-point control with hysteresis, with or without extrapolation of the measured pressure."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.registration import Choice, Range, Registration
from epv_env.observation import P2_LAGS, decode


@dataclass(kw_only=True)
class Hysteresis:
    """Open the protection valve below one threshold of the predicted error, shut it above another.

    The prediction is error + lookahead * slope, the slope being the measured change of p2 over `lag`
    control periods. Both lookaheads zero: the plain two-point controller.
    """

    open_below: float
    """Predicted p2 - target below which the coil is switched off [bar]."""
    shut_above: float
    """Predicted p2 - target above which the coil is switched on [bar]."""
    open_lookahead: float = 0.0
    """Extrapolation while shut [s]: the time the control chamber takes to vent."""
    shut_lookahead: float = 0.0
    """Extrapolation while open [s]: the time the valve takes to shut."""
    lag: int = 4
    """Control periods between the two readings whose difference is the slope, one of P2_LAGS."""
    control_period: float = 5e-3
    """[s]"""
    name: str = "hysteresis"
    environment: str = "EPValve-v0"
    _on: NDArray = field(default_factory=lambda: np.ones(0, dtype=np.int64), repr=False)

    def __post_init__(self) -> None:
        if self.lag not in P2_LAGS:
            raise ValueError(f"lag = {self.lag}: the observation holds changes over {P2_LAGS} periods")
        if self.open_below > self.shut_above:
            raise ValueError(
                f"open_below = {self.open_below:g} bar exceeds shut_above = {self.shut_above:g} bar: "
                "a hysteresis needs open_below <= shut_above"
            )

    def reset(self, n: int) -> None:
        """All coils on, as every episode begins."""
        self._on = np.ones(n, dtype=np.int64)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        error = decode(observations, "p2_error")
        slope = decode(observations, f"p2_change_{self.lag}") / (self.lag * self.control_period)
        opens = error + self.open_lookahead * slope < self.open_below
        shuts = error + self.shut_lookahead * slope > self.shut_above
        self._on = np.where(self._on == 1, np.where(opens, 0, 1), np.where(shuts, 1, 0))
        return self._on.copy()


_THRESHOLDS = {
    "open_below": Range(low=-0.45, high=0.3, least=-0.5, most=0.5),
    "shut_above": Range(low=-0.45, high=0.45, least=-0.5, most=0.5),
}

HYSTERESIS = Registration(
    kind="hysteresis",
    controller=Hysteresis,
    build=lambda values, plant: Hysteresis(name="hysteresis", **values),
    search_space=_THRESHOLDS,
)
"""The plain two-point controller."""

EXTRAPOLATING_HYSTERESIS = Registration(
    kind="extrapolating hysteresis",
    controller=Hysteresis,
    build=lambda values, plant: Hysteresis(name="extrapolating hysteresis", **values),
    search_space={
        **_THRESHOLDS,
        "open_lookahead": Range(low=0.0, high=0.15, most=0.5),
        "shut_lookahead": Range(low=0.0, high=0.06, most=0.5),
        "lag": Choice(values=P2_LAGS),
    },
)
"""The same with extrapolation of the measured pressure."""
