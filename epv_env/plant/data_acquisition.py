"""What the bench's data acquisition makes of a signal: range, 12-bit resolution and noise."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ADC_BITS = 12
"""Resolution of the data acquisition card (section 3)."""


def digitised(value, standard_normal, low, noise, resolution, least, greatest):
    """Reading of a value with noise, in whole steps of the converter from `low` on, within its ends.

    Arguments are numbers or arrays that broadcast; the environment's step compiles this function.
    """
    steps = np.rint((value - low + noise * standard_normal) / resolution)
    return np.minimum(np.maximum(low + steps * resolution, least), greatest)


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """The sensor of one channel, in the unit of the report's tables (bar absolute, A or V)."""

    low: float
    """Least value (Table 1)."""
    high: float
    """Greatest value (Table 1)."""
    accuracy: float
    """Accuracy as a fraction of the range's greatest value (Table 1); the ADC saturates beyond it."""
    noise: float
    """Standard deviation of the noise (Table 3)."""
    offset: float = 0.0
    """Reading less truth at the start of a recording (Table 2; pressures less 1 bar)."""
    trend: float = 0.0
    """Drift of the reading per second (Table 2)."""

    @property
    def resolution(self) -> float:
        """One step of the ADC [unit of the sensor]."""
        return (self.high - self.low) / 2**ADC_BITS

    def measure(self, value: NDArray, standard_normal: NDArray) -> NDArray:
        """The readings for true values, any shape [unit of the sensor]; offset and trend not included.

        standard_normal: draws of the same shape [-]. A reading saturates where the range and its
        accuracy end.
        """
        return digitised(value, standard_normal, *self.constants())

    def constants(self) -> tuple[float, float, float, float, float]:
        """What `digitised` needs: least value, noise, resolution, least and greatest reading."""
        margin = self.accuracy * self.high
        return self.low, self.noise, self.resolution, self.low - margin, self.high + margin
