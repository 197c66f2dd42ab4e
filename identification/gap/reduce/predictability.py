"""Whether what a black box predicts of held-out residuals is more than chance."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.grey_box import GreyBox
from identification.gap.reduce.block_bootstrap import block_starts

PERMUTATIONS = 1999


def p_value(
    plant: GreyBox, residuals: Sequence[NDArray], predicted: Sequence[NDArray], seed: int
) -> float:
    """Probability that blocks of the residual in random order agree as well with the prediction.

    Both per run (channels, samples). Whole blocks move, within their run and all channels together, so
    that correlations in time and between channels stay. 1 where nothing is predicted.
    """
    rng = np.random.default_rng(seed)
    agreement = np.zeros(PERMUTATIONS + 1)
    for run, residual, prediction in zip(plant.runs, residuals, predicted, strict=True):
        if not run.held_out:
            continue
        products = _blocks(prediction, run.time[1]) @ _blocks(residual, run.time[1]).T
        order = np.arange(len(products))
        agreement[0] += np.trace(products)
        agreement[1:] += [products[order, rng.permutation(order)].sum() for _ in range(PERMUTATIONS)]
    if not any(np.any(prediction) for prediction in predicted):
        return 1.0
    return float(np.mean(agreement >= agreement[0]))


def _blocks(series: NDArray, period: float) -> NDArray:
    """(channels, samples) as (blocks, channels x length), all as long as the shortest."""
    starts = block_starts(series.shape[1], period)
    length = starts[1] if len(starts) > 1 else series.shape[1]
    return np.stack([series[:, start : start + length].ravel() for start in starts])
