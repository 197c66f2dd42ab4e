"""Permutation test: whether a black box's prediction of held-out residuals is more than chance."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.grey_box import GreyBox
from identification.gap.reduce.block_bootstrap import block_starts
from identification.gap.reduce.settings import ReductionSettings


def p_value(
    plant: GreyBox,
    residuals: Sequence[NDArray],
    predicted: Sequence[NDArray],
    seed: int,
    settings: ReductionSettings,
    scale: float,
) -> float:
    """Probability that blocks of the residual in random order agree as well with the prediction.

    Whole blocks move, within their run and all channels together. So correlations in time and between
    channels stay.

    Args:
        plant: the plant with its recordings; its held-out runs count.
        residuals: per run (channels, samples) [noise deviations].
        predicted: per run (channels, samples) [noise deviations].
        seed: of the permutations.
        settings: number of permutations and length of blocks.
        scale: the plant's time scale [s].

    Returns:
        1 where nothing is predicted.
    """
    rng = np.random.default_rng(seed)
    count = settings.permutations
    agreement = np.zeros(count + 1)
    for run, residual, prediction in zip(plant.runs, residuals, predicted, strict=True):
        if not run.held_out:
            continue
        blocks = [_blocks(series, scale / run.time[1], settings) for series in (prediction, residual)]
        products = blocks[0] @ blocks[1].T
        order = np.arange(len(products))
        agreement[0] += np.trace(products)
        agreement[1:] += [products[order, rng.permutation(order)].sum() for _ in range(count)]
    if not any(np.any(prediction) for prediction in predicted):
        return 1.0
    return float(np.mean(agreement >= agreement[0]))


def _blocks(series: NDArray, scale: float, settings: ReductionSettings) -> NDArray:
    """Series (channels, samples) as (blocks, channels x length), all as long as the shortest block.

    scale: the plant's time scale [samples].
    """
    starts = block_starts(series.shape[1], scale, settings)
    length = starts[1] if len(starts) > 1 else series.shape[1]
    return np.stack([series[:, start : start + length].ravel() for start in starts])
