"""Gaps with intervals: of models on held-out runs, all under the same draws, and by regime."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.block_bootstrap import (
    LEVEL,
    Interval,
    block_length,
    block_starts,
    block_sums,
    block_weights,
    interval,
)
from identification.gap.plant import GreyBox, Run
from identification.gap.prepare.noise import residual_noise

FLOOR = 1.0
"""Gap that noise alone leaves [noise deviations]; a definition."""

WHOLE = "the_whole_recording"
"""The one regime of a plant that tells none apart."""

FEWEST_PARTS = 5
"""Fewest parts of a regime. With fewer on held-out runs all runs count; with fewer on all runs the gap
has no interval."""


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
        self, plant: GreyBox, residuals: Mapping[str, Sequence[NDArray]], seed: int, scale: float
    ):
        """Sum squares over blocks of the held-out runs.

        Args:
            plant: the plant with its recordings.
            residuals: by model, per run (channels, samples) [noise deviations].
            seed: of the bootstrap.
            scale: the plant's time scale [s].
        """
        self.plant = plant
        self._scale = scale
        held_out = [run for run in plant.runs if run.held_out]
        blocks = [len(block_starts(len(run.time), block_samples(run, scale))) for run in held_out]
        self._weights = block_weights(blocks, seed)
        # A channel without a reading has no squares: any number will do.
        self._readings = np.maximum(
            self._sums([run.trusted for run in plant.runs]), np.finfo(float).tiny
        )
        squares = {label: self._sums([np.square(y) for y in own]) for label, own in residuals.items()}
        best = min(squares, key=lambda label: np.sum(squares[label][0]))
        self.noise = np.sqrt([own.floor for own in residual_noise(plant, residuals[best])])
        """Noise deviation relative to the channel's, (channels,) [1]."""
        self._squares = {label: own / self.noise**2 for label, own in squares.items()}

    def overall(self, label: str) -> NDArray:
        """Gap of a model over all channels, (1 + draws,) [noise deviations]."""
        return np.sqrt(self._squares[label].sum(axis=1) / self._readings.sum(axis=1))

    def gap(self, label: str, percent: Mapping[str, float] | None = None) -> Gap:
        """Gap of a model, overall and by channel, with intervals; percent: kept with the result [%]."""
        by_channel = np.sqrt(self._squares[label] / self._readings)
        names = [c.name for c in self.plant.channels]
        return Gap(
            overall=interval(self.overall(label)),
            channels={n: interval(y) for n, y in zip(names, by_channel.T, strict=True)},
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
        grid = np.linspace(0.0, 1.0, 1001)
        whole, closed = self.overall(base) - FLOOR, self.overall(base) - self.overall(label)
        value = float(np.clip(closed[0] / whole[0], 0, 1)) if whole[0] > 0 else 0.0
        below = np.mean(closed[1:, None] < grid * whole[1:, None], axis=0)
        tail = 0.5 - LEVEL / 2
        kept = [value, *grid[(below >= tail) & (below <= 1 - tail)]]
        low, high = np.clip([min(kept) - grid[1], max(kept) + grid[1]], 0, 1)
        return Interval(value=value, low=float(low), high=float(high))

    def _sums(self, series: Sequence[NDArray]) -> NDArray:
        """Sums of series, per run (channels, samples), over the held-out runs, (1 + draws, channels)."""
        blocks = [
            block_sums(np.asarray(y, float), block_samples(run, self._scale))
            for y, run in zip(series, self.plant.runs, strict=True)
            if run.held_out
        ]
        return self._weights @ np.concatenate(blocks)


@dataclass(frozen=True, kw_only=True)
class RegimeGap:
    """The gap of a channel in a regime; 1 is the noise floor."""

    channel: str
    regime: str
    gap: float
    """Root mean square of (model - measured)/noise [noise deviations]."""
    low: float
    """Lower end of the interval; 0 where the regime is too rare for an interval."""
    high: float
    """Upper end of the interval; infinity where the regime is too rare for an interval."""
    held_out: bool
    """True where held-out runs alone give the gap; False where the regime is too rare in them."""


def block_samples(run: Run, scale: float) -> int:
    """Length of a bootstrap block of a run [samples]; scale: the plant's time scale [s]."""
    return block_length(len(run.time), scale / run.time[1])


def regimes_of(plant: GreyBox, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
    """Samples of each regime, boolean (samples,) by name; all of them where the plant has no regimes.

    values: one candidate's values by symbol, (1,) or (1, runs) [SI]. run: index of the run.
    """
    return plant.regimes(values, run) or {WHOLE: np.ones(len(plant.runs[run].time), dtype=bool)}


def regime_gaps(
    plant: GreyBox,
    masks: Sequence[Mapping[str, NDArray]],
    residuals: Sequence[NDArray],
    seed: int,
    scale: float,
) -> list[RegimeGap]:
    """The gap of every channel in every regime that occurs.

    The bootstrap draws whole occurrences of a regime, cut into blocks where they are long.

    Args:
        plant: the plant with its recordings.
        masks: per run, samples of each regime, boolean (samples,) by name.
        residuals: per run (channels, samples) [noise deviations], 0 at untrusted readings.
        seed: of the bootstrap.
        scale: the plant's time scale [s].
    """
    shortest = min(float(run.time[-1]) for run in plant.runs)
    block = min(4.0 * scale, 0.05 * shortest)  # longer than residuals correlate
    gaps = []
    for regime in masks[0]:
        own = [mask[regime] for mask in masks]
        squares, counts, held_out = _sums(plant, own, residuals, block, FEWEST_PARTS)
        parts = squares.shape[1]
        weights = block_weights([parts], seed) if parts >= FEWEST_PARTS else None
        for channel, square, count in zip(plant.channels, squares, counts, strict=True):
            if not np.any(count):
                continue
            if weights is None:
                gap = Interval(
                    value=float(np.sqrt(np.sum(square) / np.sum(count))), low=0.0, high=np.inf
                )
            else:
                least = np.finfo(float).tiny
                gap = interval(np.sqrt((weights @ square) / np.maximum(weights @ count, least)))
            gaps.append(
                RegimeGap(
                    channel=channel.name,
                    regime=regime,
                    gap=gap.value,
                    low=gap.low,
                    high=gap.high,
                    held_out=held_out,
                )
            )
    return gaps


def _sums(
    plant: GreyBox, masks: Sequence[NDArray], residuals: Sequence[NDArray], block: float, fewest: int
) -> tuple[NDArray, NDArray, bool]:
    """Sums over parts of held-out runs, or of all runs where those are fewer than `fewest`, and which.

    block: longest part [s].
    """
    each = [_part_sums(plant, r, mask, residuals[r], block) for r, mask in enumerate(masks)]
    squares, counts = (np.concatenate(parts, axis=1) for parts in zip(*each, strict=True))
    own = np.repeat([run.held_out for run in plant.runs], [part[0].shape[1] for part in each])
    if np.sum(own) >= fewest:
        return squares[:, own], counts[:, own], True
    return squares, counts, False


def _part_sums(
    plant: GreyBox, r: int, mask: NDArray, residual: NDArray, block: float
) -> tuple[NDArray, NDArray]:
    """Sums of squares and numbers of trusted readings of a run's regime, (channels, parts) each.

    mask: boolean (samples,). residual: (channels, samples). block: longest part [s].
    """
    run = plant.runs[r]
    inside = np.flatnonzero(mask)
    if not len(inside):
        empty = np.zeros((len(residual), 0))
        return empty, empty
    length = max(1, round(block / run.time[1]))
    begins = np.flatnonzero(np.diff(inside, prepend=-2) > 1)
    since = np.arange(len(inside)) - np.repeat(begins, np.diff(begins, append=len(inside)))
    first = np.flatnonzero(since % length == 0)
    return (
        np.add.reduceat(residual[:, inside] ** 2, first, axis=1),
        np.add.reduceat(run.trusted[:, inside].astype(float), first, axis=1),
    )
