"""Gaps of models on held-out runs with intervals, all under the same bootstrap draws."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.grey_box import GreyBox
from identification.gap.reduce.block_bootstrap import (
    Interval,
    block_starts,
    block_sums,
    block_weights,
    interval,
)
from identification.gap.reduce.noise_floor import LAGS, noise_ratios, squared_differences
from identification.gap.reduce.settings import ReductionSettings

FLOOR = 1.0
"""Gap that noise alone leaves [noise deviations]; a definition."""


@dataclass(frozen=True, kw_only=True)
class Gap:
    """The distance of a model from the held-out runs."""

    overall: Interval
    """Root mean square of (model - measured)/noise over all channels; 1.0 is the floor."""
    channels: Mapping[str, Interval]
    """The same by channel."""
    percent: Mapping[str, float] | None = None
    """Errors of the 2003 report (eqs 19-21) by channel and 'overall' [%]; None for a black box and where
    a mean vanishes."""


class GapDraws:
    """Gaps of several models by bootstrap draw; row 0 of every array is the estimate."""

    def __init__(
        self,
        plant: GreyBox,
        residuals: Mapping[str, Sequence[NDArray]],
        seed: int,
        settings: ReductionSettings,
        scale: float,
    ):
        """Sum squares over blocks of the held-out runs.

        Args:
            plant: the plant with its recordings.
            residuals: by model, per run (channels, samples) [noise deviations].
            seed: of the bootstrap.
            settings: of the bootstrap and the noise floor.
            scale: the plant's time scale [s].
        """
        self.plant = plant
        self.settings = settings
        self._scale = scale
        held_out = [run for run in plant.runs if run.held_out]
        blocks = [len(block_starts(len(run.time), scale / run.time[1], settings)) for run in held_out]
        self._weights = block_weights(blocks, seed, settings)
        # A channel without a reading has no squares: any number will do.
        self._readings = np.maximum(
            self._sums([run.trusted for run in plant.runs]), np.finfo(float).tiny
        )
        squares = {label: self._sums([np.square(y) for y in own]) for label, own in residuals.items()}
        best = min(squares, key=lambda label: np.sum(squares[label][0]))
        variograms = np.array([self._variogram(residuals[best], lag) for lag in LAGS])
        self.noise = noise_ratios(variograms, squares[best] / self._readings, settings)
        """Noise deviation relative to the channel's, (1 + draws, channels) [1]."""
        self._squares = {label: own / self.noise**2 for label, own in squares.items()}

    def overall(self, label: str) -> NDArray:
        """Gap of a model over all channels, (1 + draws,) [noise deviations]."""
        return np.sqrt(self._squares[label].sum(axis=1) / self._readings.sum(axis=1))

    def gap(self, label: str, percent: Mapping[str, float] | None = None) -> Gap:
        """Gap of a model, overall and by channel, with intervals; percent: kept with the result [%]."""
        by_channel = np.sqrt(self._squares[label] / self._readings)
        names, level = [c.name for c in self.plant.channels], self.settings.interval_level
        return Gap(
            overall=interval(self.overall(label), level),
            channels={n: interval(y, level) for n, y in zip(names, by_channel.T, strict=True)},
            percent=percent,
        )

    def share_closed(self, base: str, label: str, *variants: tuple[str, str]) -> Interval:
        """Share of the base's gap above the floor that a model closes, Fieller's interval in 0 to 1.

        The interval holds a share f unless nearly all draws have the closed part on one side of
        f (base - floor). So every share is held where there may be nothing to close. Ends are rounded
        outwards.

        Args:
            base: label of the model whose gap is to be closed.
            label: label of the model that closes it.
            variants: other pairs of base and model, whose intervals the result holds as well.
        """
        every = [self._share_closed(*pair) for pair in ((base, label), *variants)]
        return Interval(
            value=every[0].value,
            low=min(share.low for share in every),
            high=max(share.high for share in every),
        )

    def _share_closed(self, base: str, label: str) -> Interval:
        grid = np.linspace(0.0, 1.0, self.settings.share_steps + 1)
        whole, closed = self.overall(base) - FLOOR, self.overall(base) - self.overall(label)
        value = float(np.clip(closed[0] / whole[0], 0, 1)) if whole[0] > 0 else 0.0
        below = np.mean(closed[1:, None] < grid * whole[1:, None], axis=0)
        tail = 0.5 - self.settings.interval_level / 2
        kept = [value, *grid[(below >= tail) & (below <= 1 - tail)]]
        low, high = np.clip([min(kept) - grid[1], max(kept) + grid[1]], 0, 1)
        return Interval(value=value, low=float(low), high=float(high))

    def _variogram(self, residuals: Sequence[NDArray], lag: int) -> NDArray:
        """Half the mean squared differences over a lag [readings], (1 + draws, channels) [variances].

        residuals: per run (channels, samples) [noise deviations].
        """
        differences = squared_differences(self.plant, residuals, lag, self.settings)
        changes, count = [self._sums(own) for own in differences]
        return 0.5 * changes / np.maximum(count, np.finfo(float).tiny)

    def _sums(self, series: Sequence[NDArray]) -> NDArray:
        """Sums of series, per run (channels, samples), over the held-out runs, (1 + draws, channels)."""
        blocks = [
            block_sums(np.asarray(y, float), self._scale / run.time[1], self.settings)
            for y, run in zip(series, self.plant.runs, strict=True)
            if run.held_out
        ]
        return self._weights @ np.concatenate(blocks)
