"""Discharges of the control chamber: where p3 vents to, and how fast.

While the coil is off and the outflow is choked, p3 falls exponentially towards 0 bar absolute. A gauge
sensor shows a fall towards minus the ambient pressure, and wrong times show a wrong rate.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identification.recordings.rules import RULES, RecordingRules


def choked_discharges(
    p3: NDArray, energised: NDArray, ambient: float, rules: RecordingRules = RULES
) -> list[slice]:
    """Samples, from each switching-off, in which p3 falls far enough through choked flow.

    p3 [bar] and energised (boolean): (samples,). ambient [bar].
    """
    return list(_discharges(p3, energised, ambient, rules))


def discharge_ends(p3: NDArray, discharges: Sequence[slice]) -> tuple[float, float]:
    """Pressure towards which p3, (samples,) [bar], falls: of whole discharges, and of their late parts.

    Both must agree before one trusts them: a slow sensor bends the beginning.
    """
    late = [slice((2 * part.start + part.stop) // 3, part.stop) for part in discharges]
    return _common_end(p3, discharges), _common_end(p3, late)


def venting_rate(p3: NDArray, discharges: Sequence[slice], period: float) -> float:
    """Rate of the discharges of p3, (samples,) [bar absolute], towards 0 bar [1/s]. period [s]."""
    return float(np.median([_decay_rate(p3[part], period) for part in discharges]))


def _discharges(
    p3: NDArray, energised: NDArray, ambient: float, rules: RecordingRules
) -> Iterator[slice]:
    borders = [0, *(np.flatnonzero(np.diff(energised)) + 1), len(p3)]
    for first, last in pairwise(borders):
        falling = (p3[first:last] < 0.9 * p3[first]) & (p3[first:last] > rules.choked_ratio * ambient)
        if energised[first] or not np.any(falling):
            continue
        inside = first + np.flatnonzero(falling)
        part = slice(int(inside[0]), int(inside[-1]) + 1)
        long_enough = part.stop - part.start >= rules.least_discharge
        if long_enough and p3[part.stop - 1] < (1 - rules.least_fall) * p3[part.start]:
            yield part


def _common_end(p3: NDArray, parts: Sequence[slice]) -> float:
    return float(np.median([_end_of_exponential(p3[part]) for part in parts]))


def _end_of_exponential(pressure: NDArray) -> float:
    """The e of p(t) = e + (p(0) - e) exp(-k t), (samples,), by least squares on its integral.

    p(t) - p(0) = k e t - k (integral of p), which is linear in k e and k and averages noise. Time counts
    in samples, so that wrong times do not hide a wrong reference.
    """
    time = np.arange(len(pressure))
    means = 0.5 * (pressure[1:] + pressure[:-1])
    integral = np.concatenate([[0.0], np.cumsum(means)])
    basis = np.stack([np.ones(len(time)), time, -integral], axis=1)
    _, product, rate = np.linalg.lstsq(basis, pressure, rcond=None)[0]
    return float(product / rate)


def _decay_rate(pressure: NDArray, period: float) -> float:
    """Slope of the logarithm of a pressure, (samples,) [bar absolute], over time [1/s], positive."""
    slope = np.polyfit(np.arange(len(pressure)), np.log(pressure), 1)[0]
    return float(-slope / period)
