"""What a valve's pulses tell about it: a bank of Kalman filters over its opening pressure.

Each member of the bank assumes an offset of the opening pressure from the table's and estimates, with a
Kalman filter of one state, the factor between a pulse's gain and the table's. How well a member foresees
each pulse sets its probability (multiple-model estimation: Magill, IEEE Trans. Automatic Control 10
(1965); Simon, Optimal State Estimation (Wiley 2006), section 10.2).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.pulse_table import PulseTable
from epv_env.common.units import BAR
from epv_env.plant.primitives import QUARTER_PI


@dataclass(frozen=True, kw_only=True)
class BankSettings:
    """What is believed before the first pulse, and how far a pulse is trusted."""

    offsets: NDArray = field(default_factory=lambda: np.linspace(-2.2, 2.2, 45))
    """Assumed offsets of the opening pressure [bar]: 4.4 standard deviations with 0.1 bar between."""
    offset_spread: float = 0.5
    """Their standard deviation before the first pulse [bar]: piston, seat and spring within ±10 %."""
    offset_drift: float = 2e-3
    """Share of a member's probability that goes to each neighbour at a pulse [1]: the valve may change,
    and the seat's diameter makes the offset depend on the pressures."""
    gain_spread: float = 0.2
    """Standard deviation of the gain's factor before the first pulse [1]: V2, flow and delays."""
    gain_drift: float = 0.02
    """Its growth from pulse to pulse, standard deviation [1]."""
    gain_limits: tuple[float, float] = (0.4, 2.5)
    """Least and greatest factor [1]."""
    reading_error: float = 0.015
    """Standard deviation of a gain's measurement by two readings of p2 [bar]."""
    slope_error: float = 0.7
    """Standard deviation of the consumption's slope during a pulse [bar/s]: it jumps."""
    rise: float = 0.06
    """Rise of p2 in a control period, consumption apart, that shows an open valve [bar]: three standard
    deviations of two readings' difference."""
    still: float = 0.02
    """Rise below which the valve is seen to be shut [bar]."""
    late: float = 0.9
    """p3 over a member's opening pressure at which p2 must have begun to rise [1]."""
    doubt: float = 0.1
    """Factor of the probability of a member that p2 contradicts in a control period [1]."""
    table_error: float = 0.1
    """Standard deviation of the table's gain beyond a common factor, as a share of it [1]."""


BANK = BankSettings()


class OpeningBank:
    """Probabilities and gains of the members for n valves; every pulse corrects them."""

    def __init__(self, n: int, settings: BankSettings = BANK):
        """n valves of which nothing is known yet."""
        self._settings = settings
        log_prior = -0.5 * (settings.offsets / settings.offset_spread) ** 2
        prior = np.exp(log_prior) / np.sum(np.exp(log_prior))
        self._probability = np.tile(prior, (n, 1))  # (n, members)
        self._gain = np.ones((n, len(prior)))
        self._variance = np.full((n, len(prior)), settings.gain_spread**2)

    def arrays(self) -> Iterator[tuple[str, Any, str]]:
        """Name, owner and attribute of each array (n, members) that is kept between pulses."""
        for name in ("probability", "gain", "variance"):
            yield name, self, f"_{name}"

    @property
    def offset(self) -> NDArray:
        """Expected offset of the opening pressure (n,) [bar]."""
        return self._probability @ self._settings.offsets

    @property
    def offset_deviation(self) -> NDArray:
        """Standard deviation of the offset (n,) [bar]."""
        around = self._settings.offsets - self.offset[:, None]
        return np.sqrt(np.sum(self._probability * around**2, axis=1))

    def offset_quantile(self, probability: float | NDArray) -> NDArray:
        """The least member's offset that the valve's exceeds at most with 1 - probability (n,) [bar].

        probability: a number or (n,).
        """
        enough = np.reshape(probability, (-1, 1))
        below = np.sum(np.cumsum(self._probability, axis=1) < enough, axis=1)
        return self._settings.offsets[np.minimum(below, len(self._settings.offsets) - 1)]

    @property
    def gain(self) -> NDArray:
        """Expected factor of the table's gain (n,) [1]."""
        return np.sum(self._probability * self._gain, axis=1)

    @property
    def gain_deviation(self) -> NDArray:
        """Standard deviation of the factor (n,) [1]."""
        around = self._variance + (self._gain - self.gain[:, None]) ** 2
        return np.sqrt(np.sum(self._probability * around, axis=1))

    def learn(self, who: NDArray, foreseen: NDArray, gained: NDArray, lasted: NDArray) -> None:
        """Take in the pulses that ended.

        Args:
            who: indices (m,) of their valves.
            foreseen: gain by the table for each member's opening pressure (m, members) [bar].
            gained: measured gain without what was consumed (m,) [bar].
            lasted: time between the measurement's two readings (m,) [s].
        """
        s = self._settings
        variance = self._variance[who] + s.gain_drift**2
        noise = (
            s.reading_error**2 + (s.slope_error * lasted[:, None]) ** 2 + (s.table_error * foreseen) ** 2
        )
        surprise = gained[:, None] - self._gain[who] * foreseen
        spread = foreseen**2 * variance + noise
        correction = variance * foreseen / spread
        self._gain[who] = np.clip(self._gain[who] + correction * surprise, *s.gain_limits)
        self._variance[who] = (1 - correction * foreseen) * variance
        log = -0.5 * (surprise**2 / spread + np.log(spread))
        likelihood = np.exp(log - np.max(log, axis=1, keepdims=True))
        posterior = self._smeared(self._probability[who]) * likelihood
        self._probability[who] = posterior / np.sum(posterior, axis=1, keepdims=True)

    def watch(self, who: NDArray, opening: NDArray, p3: NDArray, rise: NDArray) -> None:
        """Doubt members that contradict whether p2 rises while the coil is off.

        Args:
            who: indices (m,) of the valves.
            opening: opening pressure of the table (m,) [bar].
            p3: control pressure (m,) [bar].
            rise: of p2 in the last period without what was consumed (m,) [bar].
        """
        s = self._settings
        assumed = opening[:, None] + s.offsets
        too_low = (rise > s.rise)[:, None] & (assumed < p3[:, None])
        too_high = (rise < s.still)[:, None] & (p3[:, None] < s.late * assumed)
        doubted = np.where(too_low | too_high, s.doubt, 1.0)
        posterior = self._smeared(self._probability[who]) * doubted
        self._probability[who] = posterior / np.sum(posterior, axis=1, keepdims=True)

    def _smeared(self, probability: NDArray) -> NDArray:
        """Probabilities (m, members) after the valve may have changed to a neighbour's offset."""
        share = self._settings.offset_drift
        padded = np.pad(probability, ((0, 0), (1, 1)), mode="edge")
        return (1 - 2 * share) * probability + share * (padded[:, :-2] + padded[:, 2:])


def shifted(table: PulseTable, offset: NDArray) -> PulseTable:
    """The table of valves whose opening pressure differs by `offset` (n,) [bar].

    The offset is expressed by the spring's preload, which alone shifts it at all pressures alike.
    """
    p = table.parameters
    preload = p["xPV0"] - offset * BAR * QUARTER_PI * p["d1"] ** 2 / p["cPV"]
    return replace(table, parameters={**p, "xPV0": preload})
