"""Faults of the readings: sensors and a clock as further places of a gap, beside the state equations.

A sensor may read too much or too late, and a clock may be late in all channels. Each fault is a sum of
a few forms, differences of the model's own outputs, that together come near any fault of its kind.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from identification.gap.plant import GreyBox, StateEquation, noise_weighted

LAGS, DELAYS = (1, 3, 10, 30), (1, 2, 4, 8, 16)
"""Time constants of first-order lags, and delays [samples]: their sums come near any lag or delay."""


@dataclass(frozen=True, kw_only=True)
class ReadingFault:
    """One fault of the readings."""

    place: StateEquation
    """Its name and component, as if it were an equation."""
    changes: list[NDArray]
    """Change of the outputs by each form, per run (values, forms) [noise deviations]."""
    either_sign: NDArray
    """Forms that may have either sign, boolean (forms,); others are positive."""


def reading_faults(
    plant: GreyBox, values: Mapping[str, NDArray], runs: Sequence[int]
) -> list[ReadingFault]:
    """A fault of every sensor, and one of the clock.

    Args:
        plant: the model and its recordings.
        values: one candidate's values by symbol, (1,) or (1, runs) [SI].
        runs: indices of the runs.
    """
    outputs = [np.nan_to_num(block[:, :, 0]) for block in plant.outputs(values, runs)]
    faults = [
        ReadingFault(
            place=_place(f"reading {channel.name}", "sensor"),
            changes=[_sensor_forms(y, c) for y in outputs],
            either_sign=np.arange(1 + len(LAGS)) == 0,
        )
        for c, channel in enumerate(plant.channels)
    ]
    late = [np.stack([_delay_change(y, d) for d in DELAYS], axis=2) for y in outputs]
    either_sign = np.zeros(len(DELAYS), dtype=bool)
    clock = ReadingFault(place=_place("timing", "timing"), changes=late, either_sign=either_sign)
    for fault in (*faults, clock):
        for i, (r, change) in enumerate(zip(runs, fault.changes, strict=True)):
            fault.changes[i] = noise_weighted(plant, r, change).reshape(-1, change.shape[-1])
    return [*faults, clock]


def _sensor_forms(outputs: NDArray, channel: int) -> NDArray:
    """Changes by gain error and LAGS of one channel, (channels, samples, forms) [SI].

    outputs: (channels, samples) [SI].
    """
    changes, y = np.zeros((*outputs.shape, 1 + len(LAGS))), outputs[channel]
    changes[channel, :, 0] = y
    for form, lag in enumerate(LAGS, start=1):
        keep = np.exp(-1.0 / lag)
        lagging = np.asarray(lfilter([1.0 - keep], [1.0, -keep], y - y[0])) + y[0]
        changes[channel, :, form] = lagging - y
    return changes


def physical_forms(moment: NDArray, precision: NDArray, either_sign: NDArray) -> NDArray:
    """Forms that a fault may have, boolean (forms,): a sensor may lag but not lead.

    Forms whose size would be negative are struck, the most negative one first.

    Args:
        moment: (forms,) [1].
        precision: (forms, forms) [1].
        either_sign: forms that may have either sign, boolean (forms,).
    """
    kept = np.ones(len(moment), dtype=bool)
    while np.any(kept):
        best = np.linalg.lstsq(precision[np.ix_(kept, kept)], moment[kept])[0]
        sizes = np.where(either_sign[kept], np.inf, best)
        if np.min(sizes) >= 0:
            break
        kept[np.flatnonzero(kept)[np.argmin(sizes)]] = False
    return kept


def _place(name: str, component: str) -> StateEquation:
    return StateEquation(name=name, state="", component=component, unit="", step=1.0)


def _delay_change(y: NDArray, delay: int) -> NDArray:
    """Change of series (channels, samples) by a delay of `delay` samples."""
    held = np.repeat(y[:, :1], delay, axis=1)
    return np.concatenate([held, y], axis=1)[:, : y.shape[1]] - y
