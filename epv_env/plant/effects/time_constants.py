"""Time constants of effects as rates."""

import numpy as np
from numpy.typing import NDArray

SHORTEST_TIME = 1e-4
"""Time constant below which nothing is felt of a lag or of heat in a chamber, and neither acts [s]."""


def rate(time: NDArray) -> NDArray:
    """1/time [1/s], or 0 where the time [s] is too short to be felt; shape (n,) or ()."""
    return np.where(time < SHORTEST_TIME, 0.0, 1 / np.maximum(time, SHORTEST_TIME))
