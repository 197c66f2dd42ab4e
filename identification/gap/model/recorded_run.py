"""What was measured: channels with their noise, and the runs that were recorded."""

from collections.abc import Mapping
from dataclasses import dataclass

from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One measured output."""

    name: str
    unit: str
    """Unit in which reports show the channel."""
    scale: float
    """Size of that unit in SI."""
    noise: float | None = None
    """Standard deviation of the readings about the true value [SI]; None where nobody knows it: the
    readings then show it."""
    resolution: float = 0.0
    """Step between the values that a reading can take (encoder, converter, bus) [SI]; 0 for none."""

    @property
    def known_noise(self) -> float:
        """`noise`, where it must be known [SI]: a `prepared` plant knows it of every channel.

        Raises ValueError where it is None.
        """
        if self.noise is None:
            raise ValueError(
                f"channel {self.name}: its noise is None, but residuals are weighed by it: call "
                "prepared(plant), which estimates it"
            )
        return self.noise


@dataclass(frozen=True, kw_only=True)
class Run:
    """One recording as the diagnosis sees it."""

    name: str
    held_out: bool
    """No fit uses a held-out run: the gap and its reduction are judged on these runs."""
    time: NDArray
    """Sampling instants, uniform, (samples,) [s]; they need not begin at 0."""
    measured: NDArray
    """Readings, (channels, samples) [SI]."""
    trusted: NDArray
    """Readings that count, boolean, (channels, samples); a reading at a switching instant does not, nor
    one that a slower channel lacks. What does not count may be NaN."""
    inputs: Mapping[str, NDArray]
    """Signals that act on the plant, by name, (samples,) [SI], for figures and the black box."""
