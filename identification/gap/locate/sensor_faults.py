"""Faults of the readings as further places of a gap: no state equation, but what the outputs become.

A sensor that reads too much or too late, and a clock that is late in every channel: differences of the
model's own outputs, linear in the sizes of a few forms that together come near any of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from identification.gap.model.grey_box import Equation, GreyBox, weighted

LAGS = (1, 3, 10, 30)
"""Time constants, in samples, whose first-order lags stand for any."""

DELAYS = (1, 2, 4, 8, 16)
"""Delays, in samples, that stand for any."""

TIMING = "timing"
"""Name of the place where all channels come late together."""


@dataclass(frozen=True, kw_only=True)
class Fault:
    """One fault of the readings."""

    place: Equation
    """Its name and component, as if it were an equation."""
    changes: list[NDArray]
    """What each form changes, per run (values, forms), in noise deviations."""
    signed: NDArray
    """Which forms may have either sign, boolean (forms,)."""


def faults(plant: GreyBox, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[Fault]:
    """Every fault that is possible."""
    outputs = [np.nan_to_num(block[:, :, 0]) for block in plant.outputs(values, runs)]
    found = []
    for c, channel in enumerate(plant.channels):
        changes = [np.zeros((*y.shape, 1 + len(LAGS))) for y in outputs]
        for change, y in zip(changes, outputs, strict=True):
            change[c] = np.stack([y[c], *(_lagging(y[c], lag) for lag in LAGS)], axis=1)
        name = f"reading {channel.name}"
        signed = np.arange(1 + len(LAGS)) == 0
        found.append(Fault(place=_place(name, "sensor"), changes=changes, signed=signed))
    late = [np.stack([_late(y, delay) for delay in DELAYS], axis=2) for y in outputs]
    signed = np.zeros(len(DELAYS), dtype=bool)
    found.append(Fault(place=_place(TIMING, "timing"), changes=late, signed=signed))
    return [replace(fault, changes=_flat(plant, runs, fault.changes)) for fault in found]


def _flat(plant: GreyBox, runs: Sequence[int], changes: Sequence[NDArray]) -> list[NDArray]:
    return [
        weighted(plant, r, change).reshape(-1, change.shape[-1])
        for r, change in zip(runs, changes, strict=True)
    ]


def physical(pull: NDArray, precision: NDArray, signed: NDArray) -> NDArray:
    """Which forms a fault may have, boolean (forms,): a sensor may lag but not lead.

    signed: which forms may have either sign. Forms that would take a size below zero are struck, the
    most negative one first.
    """
    kept = np.ones(len(pull), dtype=bool)
    while np.any(kept):
        sizes = np.where(
            signed[kept], np.inf, np.linalg.lstsq(precision[np.ix_(kept, kept)], pull[kept])[0]
        )
        if np.min(sizes) >= 0:
            break
        kept[np.flatnonzero(kept)[np.argmin(sizes)]] = False
    return kept


def _place(name: str, component: str) -> Equation:
    return Equation(name=name, state="", component=component, unit="", step=1.0)


def _lagging(y: NDArray, lag: float) -> NDArray:
    """What a first-order lag of `lag` samples takes from a series (samples,)."""
    keep = np.exp(-1.0 / lag)
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], y - y[0])) + y[0] - y


def _late(y: NDArray, delay: int) -> NDArray:
    """What a delay of `delay` samples changes in series (channels, samples)."""
    held = np.repeat(y[:, :1], delay, axis=1)
    return np.concatenate([held, y[:, :-delay]], axis=1) - y
