"""The tank's simulator: it is filled, drains through a pipe, and a sensor reads its level.

dh/dt = q/A - c sqrt(h/1 m) - leak h - evaporation: level h [m], inflow q known, c calibrated. The
nominal model has neither leak nor evaporation, and a sensor without lag.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

AREA = 0.5
"""Cross-section of the tank [m^2]."""

START = 0.5
"""Level at which recordings begin [m]."""

NOMINAL = {
    "c": 0.02,  # rate at which a level of 1 m falls [m/s]
    "leak": 0.0,  # [1/s]
    "evaporation": 0.0,  # [m/s]
    "lag": 0.0,  # time constant of the sensor [s]
    "start": 0.0,  # level at the start, less START [m]
    "zero": 0.0,  # of the sensor on that day [m]
}
"""Values by symbol."""

SUBSTEPS = 4
"""Steps of Euler's method in a sampling period."""


def levels(
    values: Mapping[str, NDArray], inflow: NDArray, period: float, forcing: NDArray | None = None
) -> NDArray:
    """Level of n tanks side by side (samples, n) [m].

    values: by symbol, (n,). inflow: (samples,) [m^3/s]. period: of sampling [s]. forcing: added to
    dh/dt, (samples, n) [m/s].
    """
    forced = np.zeros((len(inflow), 1)) if forcing is None else forcing
    p = {**NOMINAL, **values}
    level = np.full(np.broadcast(forced[0], *p.values()).shape, START) + p["start"]
    course = []
    for q, own in zip(inflow, forced, strict=True):
        course.append(level)
        for _ in range(SUBSTEPS):
            h = np.maximum(level, 1e-6)
            rate = q / AREA - p["c"] * np.sqrt(h) - p["leak"] * h - p["evaporation"] + own
            level = level + period / SUBSTEPS * rate
    return np.array(course)


def readings(values: Mapping[str, NDArray], level: NDArray, period: float) -> NDArray:
    """Readings (samples, n) [m] of a sensor with a lag and a zero offset.

    values: by symbol, (n,) [SI]. level: (samples, n) [m]. period: of sampling [s].
    """
    p = {**NOMINAL, **values}
    follow = 1 - np.exp(-period / np.maximum(p["lag"], 1e-3))
    read = [level[0]]
    for now in level[1:]:
        read.append(read[-1] + follow * (now - read[-1]))
    return np.array(read) + p["zero"]
