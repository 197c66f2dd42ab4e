"""Gaps of models on held-out runs with intervals, all under the same draws of blocks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.grey_box import GreyBox
from identification.gap.reduce.block_bootstrap import (
    LEVEL,
    Interval,
    block_starts,
    block_sums,
    block_weights,
    interval,
)
from identification.gap.reduce.noise_floor import differences, noise_draws

FLOOR = 1.0
"""What noise alone leaves of a gap."""

SHARES = np.linspace(0.0, 1.0, 1001)
"""Shares of the explainable gap that are held against the data."""


@dataclass(frozen=True, kw_only=True)
class Gap:
    """A model against the held-out runs."""

    overall: Interval
    """rms of (model - measured)/noise; 1.0 is the floor."""
    channels: Mapping[str, Interval]
    percent: Mapping[str, float] | None = None
    """Eqs 19-21 by channel and 'overall' [%]; None for a black box and where a mean vanishes."""


class Draws:
    """Gaps of models by draw of blocks; row 0 is the estimate."""

    def __init__(self, plant: GreyBox, residuals: Mapping[str, Sequence[NDArray]], seed: int):
        """residuals: by model, per run (channels, samples), in the channels' noise deviations."""
        self.plant = plant
        runs = [run for run in plant.runs if run.held_out]
        self.weights = block_weights([len(block_starts(len(r.time), r.time[1])) for r in runs], seed)
        self.readings = self._sums([run.trusted for run in plant.runs])
        squares = {label: self._sums([np.square(y) for y in each]) for label, each in residuals.items()}
        finest = min(squares, key=lambda label: np.sum(squares[label][0]))
        changes, number = [self._sums(each) for each in differences(plant, residuals[finest])]
        self.noise = noise_draws(changes / number, squares[finest] / self.readings)
        """Noise deviation by draw and channel, relative to the channel's."""
        self.squares = {label: each / self.noise**2 for label, each in squares.items()}

    def overall(self, label: str) -> NDArray:
        """A model's gap over all channels, by draw."""
        return np.sqrt(self.squares[label].sum(axis=1) / self.readings.sum(axis=1))

    def gap(self, label: str, percent: Mapping[str, float] | None = None) -> Gap:
        """A model's gap, overall and by channel, with intervals."""
        by_channel = np.sqrt(self.squares[label] / self.readings)
        names = [channel.name for channel in self.plant.channels]
        return Gap(
            overall=interval(self.overall(label)),
            channels={n: interval(y) for n, y in zip(names, by_channel.T, strict=True)},
            percent=percent,
        )

    def share(self, base: str, label: str, *also: tuple[str, str]) -> Interval:
        """Share of the base's gap above the floor that a model closes, Fieller's interval in 0 to 1.

        A share f is kept unless nearly all draws have the part that is closed on one side of
        f (base - floor); so every share is kept where there may be nothing to close. Ends are rounded
        outwards. also: other pairs of base and model that judge the same; the interval holds theirs too.
        """
        every = [self._share(*pair) for pair in ((base, label), *also)]
        return Interval(
            value=every[0].value,
            low=min(found.low for found in every),
            high=max(found.high for found in every),
        )

    def _share(self, base: str, label: str) -> Interval:
        whole, closed = self.overall(base) - FLOOR, self.overall(base) - self.overall(label)
        value = float(np.clip(closed[0] / whole[0], 0, 1)) if whole[0] > 0 else 0.0
        less = np.mean(closed[1:, None] < SHARES * whole[1:, None], axis=0)
        tail = 0.5 - LEVEL / 2
        kept = [value, *SHARES[(less >= tail) & (less <= 1 - tail)]]
        low, high = np.clip([min(kept) - SHARES[1], max(kept) + SHARES[1]], 0, 1)
        return Interval(value=value, low=float(low), high=float(high))

    def _sums(self, series: Sequence[NDArray]) -> NDArray:
        """Sums over the held-out runs by draw, (draws, channels)."""
        pairs = zip(series, self.plant.runs, strict=True)
        blocks = [block_sums(np.asarray(y, float), run.time[1]) for y, run in pairs if run.held_out]
        return self.weights @ np.concatenate(blocks)
