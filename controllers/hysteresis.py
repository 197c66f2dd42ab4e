"""Two-point control with hysteresis, with or without extrapolation of the measured pressure."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from controllers.base import OneValve, compiled, over_batch
from controllers.registration import Choice, Range, Registration
from epv_env.observation import P2_LAGS


class Thresholds(NamedTuple):
    """A hysteresis as numbers, for compiled code."""

    open_below: float
    shut_above: float
    open_lookahead: float
    shut_lookahead: float
    lag: int
    change: int
    """Place of `lag` in P2_LAGS."""


@compiled
def two_points(on, r, thresholds, period):
    """Whether the coil shall be on (1 or 0), for a record of READINGS and whether it is on."""
    slope = r.p2_change[thresholds.change] / (thresholds.lag * period)
    if on > 0:
        return 0.0 if r.error + thresholds.open_lookahead * slope < thresholds.open_below else 1.0
    return 1.0 if r.error + thresholds.shut_lookahead * slope > thresholds.shut_above else 0.0


@compiled
def decide(m, r, observation, p, period):
    """One valve's decision (controllers.base.OneValve)."""
    m.off = 1.0 - two_points(1.0 - m.off, r, p, period)
    return 1.0 - m.off


@dataclass(kw_only=True)
class Hysteresis(OneValve):
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
    decide, decide_all = staticmethod(decide), over_batch(decide)
    record = np.dtype((np.record, [("off", np.float64)]))

    def __post_init__(self) -> None:
        if self.lag not in P2_LAGS:
            raise ValueError(f"lag = {self.lag}: the observation holds changes over {P2_LAGS} periods")
        if self.open_below > self.shut_above:
            raise ValueError(
                f"open_below = {self.open_below:g} bar exceeds shut_above = {self.shut_above:g} bar: "
                "a hysteresis needs open_below <= shut_above"
            )
        self.constants = Thresholds(
            self.open_below, self.shut_above, self.open_lookahead, self.shut_lookahead,
            self.lag, P2_LAGS.index(self.lag),
        )  # fmt: skip


_THRESHOLDS = {
    "open_below": Range(low=-0.45, high=0.3),
    "shut_above": Range(low=-0.45, high=0.45),
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
        "open_lookahead": Range(low=0.0, high=0.15),
        "shut_lookahead": Range(low=0.0, high=0.06),
        "lag": Choice(values=P2_LAGS),
    },
)
"""The same with extrapolation of the measured pressure."""
