"""Block bootstrap of an estimate, to check the sandwich covariance without its normality.

Blocks of consecutive instants are drawn with replacement and the estimate is moved by one Gauss-Newton
step on each draw (the one-step bootstrap of Davidson & MacKinnon 1999), which needs no simulation.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.confidence.covariance import score_series
from identification.confidence.settings import CONFIDENCE


def block_bootstrap(
    residuals: Sequence[NDArray],
    jacobians: Sequence[NDArray],
    *,
    block: int,
    prior: NDArray | None = None,
    seed: int = 0,
    draws: int = CONFIDENCE.bootstrap_draws,
) -> NDArray:
    """Movements of the scaled estimate (draws, k) under blocks drawn within each recording.

    Args:
        residuals: weighted, per recording (3 samples,).
        jacobians: by the scaled parameters, per recording (3 samples, k).
        block: length of the blocks [samples].
        prior: derivatives (p, k) of what is known before, which no draw changes; None: nothing is.
    """
    known = 0.0 if prior is None else prior.T @ prior
    H = np.linalg.inv(sum(J.T @ J for J in jacobians) + known)
    sums = [_block_sums(s, block) for s in score_series(residuals, jacobians)]
    rng = np.random.default_rng(seed)
    moved = np.zeros((draws, H.shape[0]))
    for blocks in sums:
        counts = rng.multinomial(len(blocks), np.full(len(blocks), 1.0 / len(blocks)), draws)
        moved += (counts - 1.0) @ blocks @ H
    return moved


def _block_sums(scores: NDArray, block: int) -> NDArray:
    """Sums over consecutive blocks (blocks, k); the last one may be shorter."""
    return np.add.reduceat(scores, np.arange(0, len(scores), block), axis=0)
