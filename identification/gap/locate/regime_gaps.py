"""The gap in each regime of the plant, channel by channel, with intervals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.locate.settings import LocalisationSettings
from identification.gap.model.grey_box import GreyBox
from identification.gap.reduce.block_bootstrap import block_weights, interval
from identification.gap.reduce.settings import ReductionSettings

WHOLE = "the_whole_recording"
"""The one regime of a plant that tells none apart."""


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
    settings: LocalisationSettings,
    bootstrap: ReductionSettings,
    scale: float,
) -> list[RegimeGap]:
    """The gap of every channel in every regime that occurs.

    The bootstrap draws whole occurrences of a regime, cut into blocks where they are long.

    Args:
        plant: the plant with its recordings.
        masks: per run, samples of each regime, boolean (samples,) by name.
        residuals: per run (channels, samples) [noise deviations], 0 at untrusted readings.
        seed: of the bootstrap.
        settings: length and least number of the parts of a regime.
        bootstrap: number of draws, and level of the intervals.
        scale: the plant's time scale [s].
    """
    shortest = min(float(run.time[-1]) for run in plant.runs)
    block = min(settings.regime_block * scale, settings.regime_block_share * shortest)
    gaps = []
    for regime in masks[0]:
        own = [mask[regime] for mask in masks]
        squares, counts, held_out = _sums(plant, own, residuals, block, settings.fewest_parts)
        parts = squares.shape[1]
        weights = block_weights([parts], seed, bootstrap) if parts >= settings.fewest_parts else None
        for channel, square, count in zip(plant.channels, squares, counts, strict=True):
            if np.any(count):
                gap, low, high = _gap_and_interval(square, count, weights, bootstrap)
                gaps.append(
                    RegimeGap(
                        channel=channel.name,
                        regime=regime,
                        gap=gap,
                        low=low,
                        high=high,
                        held_out=held_out,
                    )
                )
    return gaps


def _sums(
    plant: GreyBox,
    masks: Sequence[NDArray],
    residuals: Sequence[NDArray],
    block: float,
    fewest: int,
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


def _gap_and_interval(
    squares: NDArray, counts: NDArray, weights: NDArray | None, bootstrap: ReductionSettings
) -> tuple[float, float, float]:
    """Root mean square and its interval from sums over parts (parts,); weights: None for too few."""
    if weights is None:
        return float(np.sqrt(np.sum(squares) / np.sum(counts))), 0.0, np.inf
    least = np.finfo(float).tiny
    rms = np.sqrt((weights @ squares) / np.maximum(weights @ counts, least))
    gap = interval(rms, bootstrap.interval_level)
    return gap.value, gap.low, gap.high
