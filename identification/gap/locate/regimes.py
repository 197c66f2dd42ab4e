"""How large the gap is in each regime of the plant, channel by channel, and how sure that is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.grey_box import GreyBox
from identification.gap.reduce.block_bootstrap import block_weights, interval

BLOCK = 0.02
"""Longest piece of a regime that the bootstrap draws as one [s]: longer than residuals remember."""

FEWEST = 5
"""Fewest pieces: with fewer on held-out runs all runs are taken, with fewer on all nothing is sure."""


@dataclass(frozen=True, kw_only=True)
class RegimeGap:
    """Root mean square of (model - measured)/noise of a channel in a regime; 1 is the floor."""

    channel: str
    regime: str
    gap: float
    low: float
    high: float
    """90 % interval; 0 and infinity where the regime is met too seldom to tell."""
    held_out: bool
    """Whether held-out runs alone tell it; else the regime is too rare there and all runs do."""


def regime_gaps(
    plant: GreyBox,
    masks: Sequence[Mapping[str, NDArray]],
    residuals: Sequence[NDArray],
    seed: int,
) -> list[RegimeGap]:
    """Gap of every channel in every regime that occurs.

    masks: per run, boolean (samples,) by regime. residuals: per run (channels, samples), in noise
    deviations, 0 where readings are not trusted. The bootstrap draws whole occurrences of a regime, cut
    into blocks where they are long.
    """
    found = []
    for regime in masks[0]:
        squares, counts, held_out = _told(plant, [mask[regime] for mask in masks], residuals)
        weights = block_weights([squares.shape[1]], seed) if squares.shape[1] >= FEWEST else None
        for channel, square, count in zip(plant.channels, squares, counts, strict=True):
            if np.any(count):
                gap, low, high = _interval(square, count, weights)
                found.append(
                    RegimeGap(
                        channel=channel.name,
                        regime=regime,
                        gap=gap,
                        low=low,
                        high=high,
                        held_out=held_out,
                    )
                )
    return found


def _told(
    plant: GreyBox, masks: Sequence[NDArray], residuals: Sequence[NDArray]
) -> tuple[NDArray, NDArray, bool]:
    """Sums of `_pieces` over the held-out runs, or over all where those tell too little, and which."""
    each = [_pieces(plant, r, mask, residuals[r]) for r, mask in enumerate(masks)]
    squares, counts = (np.concatenate(parts, axis=1) for parts in zip(*each, strict=True))
    own = np.repeat([run.held_out for run in plant.runs], [part[0].shape[1] for part in each])
    if np.sum(own) >= FEWEST:
        return squares[:, own], counts[:, own], True
    return squares, counts, False


def _pieces(plant: GreyBox, r: int, mask: NDArray, residual: NDArray) -> tuple[NDArray, NDArray]:
    """Sums of squares and numbers of trusted readings, (channels, pieces), of one run's regime."""
    run = plant.runs[r]
    inside = np.flatnonzero(mask)
    if not len(inside):
        empty = np.zeros((len(residual), 0))
        return empty, empty
    length = max(1, round(BLOCK / run.time[1]))
    begins = np.flatnonzero(np.diff(inside, prepend=-2) > 1)
    since = np.arange(len(inside)) - np.repeat(begins, np.diff(begins, append=len(inside)))
    first = np.flatnonzero(since % length == 0)
    return (
        np.add.reduceat(residual[:, inside] ** 2, first, axis=1),
        np.add.reduceat(run.trusted[:, inside].astype(float), first, axis=1),
    )


def _interval(squares: NDArray, counts: NDArray, weights: NDArray | None) -> tuple[float, float, float]:
    """Root mean square and its interval from sums over pieces; weights: None for too few pieces."""
    if weights is None:
        return float(np.sqrt(np.sum(squares) / np.sum(counts))), 0.0, np.inf
    least = np.finfo(float).tiny
    found = interval(np.sqrt((weights @ squares) / np.maximum(weights @ counts, least)))
    return found.value, found.low, found.high
