"""Telling gauge from absolute pressures by what physics allows (bar, as in the file).

A sensor that reads 0 at ambient pressure shifts every value by about -1 bar. Three things give it away:
a vented chamber reads less than ambient pressure; p3 vents towards -1 bar, where choked flow, which is
proportional to absolute pressure, leads towards 0; and p1 lies below p3, although the open inlet joins
them. A circuit pressure p2 that is gauge alone shows only in a recording at rest.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.sensors import SENSORS
from identification.recordings.columns import line_number
from identification.recordings.recording import CampaignError
from identification.recordings.rules import RULES, RecordingRules

MARGIN = SENSORS["p1"].accuracy * SENSORS["p1"].high
"""Accuracy of the pressure sensors (Table 1) [bar]."""

REMEDY = "looks like gauge pressure: give bar absolute (add the environment's pressure)"
"""End of the sentences that refuse a gauge pressure."""


def check_above_ambient(file: str, name: str, pressure: NDArray, ambient: float) -> None:
    """No pressure (samples,) [bar] falls below ambient pressure by more than the sensor's accuracy.

    A hundredth of the samples may: a few are a fault of another kind.
    """
    if np.quantile(pressure, 0.01) < ambient - MARGIN:
        sample = int(np.argmax(pressure < ambient - MARGIN))
        raise CampaignError(
            f"{file}, line {line_number(sample)}: {name} is {pressure[sample]:g}, less than the "
            "environment's "
            f"{ambient:g} bar by more than the sensor's accuracy of {MARGIN:g} bar, which {REMEDY}"
        )


def check_discharge(
    file: str,
    U: NDArray,
    p3: NDArray,
    period: float,
    ambient: float,
    rules: RecordingRules = RULES,
) -> None:
    """p3 vents towards absolute zero while its outflow is choked, not towards ambient below it.

    U [V], p3 [bar]: (samples,). Whole discharges and the last two thirds of them must agree: a slow
    sensor bends the beginning.
    """
    discharges = list(_choked_discharges(U, p3, period, ambient, rules))
    if not discharges:
        return
    end = _common_end(p3, discharges, period)
    late = [slice((2 * part.start + part.stop) // 3, part.stop) for part in discharges]
    ends = np.array([end, _common_end(p3, late, period)])
    if np.all(np.abs(ends + ambient) < rules.gauge_likeness * ambient):
        raise CampaignError(
            f"{file}, line {line_number(discharges[0].start)}: p3_bar vents towards {end:.2f} bar "
            "where choked "
            f"flow leads towards 0 bar absolute, which {REMEDY}"
        )


def check_against_supply(file: str, name: str, p1: NDArray, p3: NDArray) -> None:
    """In the steady start p3 equals p1: p1 is not lower by more than both accuracies.

    Nor is it higher, if it stands still: a supply may lose pressure on its way, a dead sensor may not
    pass for one in coarse steps.

    p1, p3: of the steady start, (samples,) [bar]. Raises CampaignError.
    """
    difference = float(np.mean(p1) - np.mean(p3))
    if difference < -2 * MARGIN:
        raise CampaignError(
            f"{file}, lines {line_number(0)} to {line_number(len(p1) - 1)}: {name} is "
            f"{-difference:.2f} bar less than "
            f"p3_bar, to which the energised valve joins it, which {REMEDY}"
        )
    if np.ptp(p1) == 0 and difference > 2 * MARGIN:
        raise CampaignError(
            f"{file}, lines {line_number(0)} to {line_number(len(p1) - 1)}: {name} is {p1[0]:g} "
            f"without noise and {difference:.2f} bar more than p3_bar, to which the energised valve "
            "joins it: check its sensor"
        )


def _choked_discharges(
    U: NDArray, p3: NDArray, period: float, ambient: float, rules: RecordingRules
) -> Iterator[slice]:
    """Samples, from each switching-off, in which p3 falls far enough through choked flow."""
    energised = 0.5 * np.max(U) < U
    borders = [0, *(np.flatnonzero(np.diff(energised)) + 1), len(U)]
    for first, last in pairwise(borders):
        falling = (p3[first:last] < 0.9 * p3[first]) & (p3[first:last] > rules.choked_ratio * ambient)
        if energised[first] or not np.any(falling):
            continue
        inside = first + np.flatnonzero(falling)
        part = slice(int(inside[0]), int(inside[-1]) + 1)
        long_enough = (part.stop - part.start) * period >= rules.shortest_discharge
        if long_enough and p3[part.stop - 1] < (1 - rules.least_fall) * p3[part.start]:
            yield part


def _common_end(p3: NDArray, parts: Sequence[slice], period: float) -> float:
    return float(np.median([_end_of_exponential(p3[part], period) for part in parts]))


def _end_of_exponential(pressure: NDArray, period: float) -> float:
    """The e of p(t) = e + (p(0) - e) exp(-k t), (samples,), by least squares on its integral.

    p(t) - p(0) = k e t - k (integral of p), which is linear in k e and k and averages noise.
    """
    time = np.arange(len(pressure)) * period
    means = 0.5 * (pressure[1:] + pressure[:-1])
    integral = np.concatenate([[0.0], np.cumsum(means) * period])
    basis = np.stack([np.ones_like(time), time, -integral], axis=1)
    _, product, rate = np.linalg.lstsq(basis, pressure, rcond=None)[0]
    return float(product / rate)
