"""What the bench's data acquisition makes of a signal: range, 12-bit resolution and noise."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ADC_BITS = 12
"""Resolution of the data acquisition card (section 3)."""


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """One measured channel, in the unit of the report's tables (bar absolute, A or V)."""

    low: float
    """Least value (Table 1)."""
    high: float
    """Greatest value (Table 1)."""
    accuracy: float
    """Accuracy as a fraction of the range's greatest value (Table 1); the ADC saturates beyond it."""
    noise: float
    """Standard deviation of the noise (Table 3)."""

    @property
    def resolution(self) -> float:
        """One step of the ADC."""
        return (self.high - self.low) / 2**ADC_BITS

    def measure(self, value: NDArray, standard_normal: NDArray) -> NDArray:
        """The reading for a true value and a standard normal draw of the same shape."""
        margin = self.accuracy * self.high
        steps = np.rint((value - self.low + self.noise * standard_normal) / self.resolution)
        reading = self.low + steps * self.resolution
        return np.clip(reading, self.low - margin, self.high + margin)


SENSORS: dict[str, Sensor] = {
    "p1": Sensor(low=1.0, high=16.0, accuracy=0.016, noise=0.0068),
    "p2": Sensor(low=1.0, high=16.0, accuracy=0.016, noise=0.0098),
    "p3": Sensor(low=1.0, high=16.0, accuracy=0.016, noise=0.0075),
    "I": Sensor(low=-1.0, high=1.0, accuracy=0.01, noise=0.0008),
    "U": Sensor(low=-32.0, high=32.0, accuracy=0.01, noise=0.0122),
}
"""The bench's channels: Table 1's range and accuracy, Table 3's standard deviation."""
