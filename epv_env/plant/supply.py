"""Where the input chamber's air comes from: constant, recorded, or reservoirs with a compressor."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from epv_env.common.field_types import check_fields
from epv_env.common.units import BAR


def two_point(p1, ran, cut_in, cut_out):
    """Whether a compressor runs: from `cut_in` until `cut_out`, by its memory in between.

    Pressures [Pa absolute]; ran: whether it ran before. Arguments are numbers or arrays that broadcast;
    the environment's step compiles this function.
    """
    return (p1 < cut_in) | (ran & (p1 < cut_out))


@dataclass(frozen=True, kw_only=True)
class Supply:
    """The supply of the input chamber, the same rule for every valve of a batch.

    Two 40-litre reservoirs feed the report's bench (section 3). Air drawn through the valve lowers their
    pressure; a compressor that starts at `cut_in` and stops at `cut_out` refills them.
    """

    pressure: tuple[float, float]
    """Range from which an episode's first p1 is drawn [Pa absolute]; equal ends fix it."""
    volume: float = np.inf
    """V1 of the reservoirs [m^3]; infinite: the supply does not sag."""
    cut_in: float = 0.0
    """Pressure at which the compressor starts [Pa absolute]."""
    cut_out: float = 0.0
    """Pressure at which the compressor stops [Pa absolute]."""
    delivery: float = 0.0
    """Air that the running compressor delivers [kg/s]."""
    idle_until: float = 0.0
    """Time since the episode's start before which the compressor stands still [s]."""
    recording: tuple[NDArray, NDArray] | None = None
    """Recorded time [s] and p1 [Pa absolute], held constant beyond its ends."""

    def __post_init__(self) -> None:
        check_fields(self)
        low, high = self.pressure
        if not 0 < low <= high:
            raise ValueError(
                f"supply pressure range [{low:g}, {high:g}] Pa is empty or not positive: "
                "give 0 < low <= high, absolute"
            )
        if not (self.volume > 0 and self.delivery >= 0):
            raise ValueError(
                f"supply volume {self.volume:g} m^3 must be positive, and the compressor's delivery "
                f"{self.delivery:g} kg/s at least 0"
            )
        if self.cut_in > self.cut_out:
            raise ValueError(
                f"compressor cut-in {self.cut_in:g} Pa is above its cut-out {self.cut_out:g} Pa: "
                "give cut_in <= cut_out"
            )

    @classmethod
    def constant(cls, low_bar: float, high_bar: float | None = None) -> "Supply":
        """A supply that holds one pressure whatever is drawn from it: low_bar, or a draw for every
        episode from low_bar to high_bar [bar absolute]."""
        return cls(pressure=(low_bar * BAR, (low_bar if high_bar is None else high_bar) * BAR))

    @classmethod
    def reservoirs(
        cls, pressure_bar: tuple[float, float] = (10.5, 12.5), volume_litres: float = 80.0
    ) -> "Supply":
        """Two 40-litre reservoirs and a compressor of 5 g/s between 10.5 and 12.5 bar absolute.

        The delivery is that of a truck's single-cylinder compressor at idle, about 250 litres/min.
        """
        return cls(
            pressure=(pressure_bar[0] * BAR, pressure_bar[1] * BAR),
            volume=volume_litres * 1e-3,
            cut_in=10.5 * BAR,
            cut_out=12.5 * BAR,
            delivery=5e-3,
        )

    @classmethod
    def starved(cls, pressure_bar: float, *, refill_s: float) -> "Supply":
        """Reservoirs at a low pressure [bar absolute], cut off until a full line refills them.

        The refill begins at refill_s [s] and lasts less than a second, from 5 to 12.5 bar.
        """
        reservoirs = cls.reservoirs((pressure_bar, pressure_bar))
        return replace(
            reservoirs, delivery=0.8, idle_until=refill_s
        )  # from 5 to 12.5 bar within a second

    @classmethod
    def recorded(cls, time_s: NDArray, pressure_bar: NDArray) -> "Supply":
        """A measured p1, linear between its samples.

        time_s: increasing times (samples,) [s]. pressure_bar: p1 (samples,) [bar absolute]. Raises
        ValueError for times that do not increase and pressures that are not positive.
        """
        time, pressure = np.asarray(time_s, float), np.asarray(pressure_bar, float) * BAR
        shaped = time.ndim == 1 and time.size > 0 and time.shape == pressure.shape
        if not shaped or not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0):
            raise ValueError("a recorded supply needs increasing times and one pressure for each")
        if not np.all((pressure > 0) & np.isfinite(pressure)):
            raise ValueError("a recorded supply needs positive, finite pressures [bar absolute]")
        first = float(np.interp(0.0, time, pressure))
        return cls(pressure=(first, first), recording=(time, pressure))

    def draw(self, rng: np.random.Generator) -> float:
        """An episode's first p1 [Pa]."""
        return float(rng.uniform(*self.pressure))

    def slope(self, time: NDArray, period: float) -> NDArray:
        """Imposed dp1/dt, (n,) [Pa/s], over the period [s] that starts at each `time`, (n,) [s]."""
        if self.recording is None:
            return np.zeros_like(time)
        return (np.interp(time + period, *self.recording) - np.interp(time, *self.recording)) / period

    @property
    def lasting(self) -> float:
        """Pressure that the supply has in the long run, at least [Pa absolute]."""
        return max(self.pressure[0], self.cut_in)
