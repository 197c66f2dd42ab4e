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

from identification.gap.reduce.settings import ReductionSettings


@dataclass(frozen=True, kw_only=True)
class Interval:
    """An estimate and the ends of its interval."""

    value: float
    low: float
    high: float


def block_starts(samples: int, scale: float, settings: ReductionSettings) -> NDArray:
    """First samples of a run's blocks, (blocks,) with 2 or more; a shorter rest joins the last block.

    samples: of the run. scale: the plant's time scale [samples].
    """
    duration = min(settings.block_duration * scale, settings.block_share * samples)
    length = min(max(settings.least_block_samples, round(duration)), samples // 2)
    return np.arange(samples // length) * length


def block_sums(series: NDArray, scale: float, settings: ReductionSettings) -> NDArray:
    """Sums over the blocks of a run: series (..., samples) of any unit become sums (blocks, ...).

    scale: the plant's time scale [samples].
    """
    starts = block_starts(series.shape[-1], scale, settings)
    return np.moveaxis(np.add.reduceat(series, starts, axis=-1), -1, 0)


def block_weights(blocks: Sequence[int], seed: int, settings: ReductionSettings) -> NDArray:
    """Weights of all runs' blocks, one run after the other, (1 + draws, blocks) [1].

    The first row takes each block once: the estimate. The variance of a weight is 1, that of drawing
    with replacement freed of its bias n/(n - 1), times the square of Student's quantile over the normal
    one: few blocks determine their own scatter badly.

    Args:
        blocks: number of blocks in each run, 2 or more.
        seed: of the draws.
        settings: number of draws and level of the intervals.
    """
    rng = np.random.default_rng(seed)
    tail = 0.5 + settings.interval_level / 2
    student = float(stats.t.ppf(tail, sum(blocks) - len(blocks)) / stats.norm.ppf(tail))
    drawn = []
    for n in blocks:
        concentration = max(((n - 1) / student**2 - 1) / n, settings.least_concentration)
        drawn.append(n * rng.dirichlet(np.full(n, concentration), settings.draws))
    return np.vstack([np.ones(sum(blocks)), np.hstack(drawn)])


def interval(values: NDArray, level: float) -> Interval:
    """Percentile interval from values (1 + draws,): the estimate, then its draws.

    level: share of the draws within the interval [1].
    """
    low, high = np.quantile(values[1:], [0.5 - level / 2, 0.5 + level / 2])
    return Interval(value=float(values[0]), low=float(low), high=float(high))
