"""Block bootstrap within runs: uncertainty by the stretches that happened to be recorded.

Blocks of consecutive samples (Künsch 1989) keep what is correlated over less than a block together. Each
run's blocks get random weights (Bayesian bootstrap of Rubin 1981: no weight is negative). The draws are
a matrix of weights. A function of sums over samples needs its sums over blocks only, and models under
the same weights are compared in pairs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

DRAWS = 2000
"""Number of draws: the ends of a 95 % interval then vary by about 1.5 percent of its width."""

LEVEL = 0.95
"""Share of the draws within an interval [1]."""

LEAST_CONCENTRATION = 0.05
"""Lower bound of the Dirichlet parameter [1]; below it one block has all weight."""


@dataclass(frozen=True, kw_only=True)
class Interval:
    """An estimate and the ends of its interval."""

    value: float
    low: float
    high: float


def block_length(samples: int, scale: float) -> int:
    """Length of a block for a plant's time scale [samples]: six of them, longer than a transient.

    It is at most a twentieth of the run, which gives slow plants enough blocks, and at least 20 samples.

    samples: of the run.
    """
    return max(20, round(min(6.0 * scale, 0.05 * samples)))


def block_starts(samples: int, length: int) -> NDArray:
    """First samples of a run's blocks, (blocks,) with 2 or more; a shorter rest joins the last block.

    samples: of the run. length: of a block [samples], at most half the run is used.
    """
    length = min(length, samples // 2)
    return np.arange(samples // length) * length


def block_sums(series: NDArray, length: int) -> NDArray:
    """Sums over the blocks of a run: series (..., samples) of any unit become sums (blocks, ...).

    length: of a block [samples].
    """
    starts = block_starts(series.shape[-1], length)
    return np.moveaxis(np.add.reduceat(series, starts, axis=-1), -1, 0)


def block_weights(blocks: Sequence[int], seed: int) -> NDArray:
    """Weights of all runs' blocks, one run after the other, (1 + DRAWS, blocks) [1].

    The first row takes each block once: the estimate. The variance of a weight is 1, that of drawing
    with replacement freed of its bias n/(n - 1), times the square of Student's quantile over the normal
    one: few blocks determine their own scatter badly.

    Args:
        blocks: number of blocks in each run, 2 or more.
        seed: of the draws.
    """
    rng = np.random.default_rng(seed)
    tail = 0.5 + LEVEL / 2
    student = float(stats.t.ppf(tail, sum(blocks) - len(blocks)) / stats.norm.ppf(tail))
    drawn = []
    for n in blocks:
        concentration = max(((n - 1) / student**2 - 1) / n, LEAST_CONCENTRATION)
        drawn.append(n * rng.dirichlet(np.full(n, concentration), DRAWS))
    return np.vstack([np.ones(sum(blocks)), np.hstack(drawn)])


def interval(values: NDArray) -> Interval:
    """Percentile interval from values (1 + draws,): the estimate, then its draws."""
    low, high = np.quantile(values[1:], [0.5 - LEVEL / 2, 0.5 + LEVEL / 2])
    return Interval(value=float(values[0]), low=float(low), high=float(high))
