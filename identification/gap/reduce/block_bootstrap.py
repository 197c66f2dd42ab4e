"""Block bootstrap within runs: how much a figure owes to the stretches that happened to be recorded.

Blocks of consecutive samples (Künsch 1989), so that what is correlated over less than a block stays
together, are weighted at random, each run's among themselves (the Bayesian bootstrap of Rubin 1981: no
block ever counts less than nothing). Draws are a matrix of weights: whatever is a function of sums over
samples needs its sums over blocks only, and models under the same weights are compared in pairs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

BLOCK = 0.03
"""Length of a block [s]: longer than the valve's transients."""

LEAST = 20
"""Samples of the shortest block, for plants that are read more slowly."""

DRAWS = 2000
LEVEL = 0.9
"""Share of the draws between the ends of an interval."""


@dataclass(frozen=True, kw_only=True)
class Interval:
    """An estimate between the ends of its 90 % interval."""

    value: float
    low: float
    high: float


def block_starts(samples: int, period: float) -> NDArray:
    """Where the blocks of a run begin [samples], 2 or more; a shorter rest joins the last one."""
    length = min(max(LEAST, round(BLOCK / period)), samples // 2)
    return np.arange(samples // length) * length


def block_sums(series: NDArray, period: float) -> NDArray:
    """Sums over the blocks of a run, (..., samples) to (blocks, ...)."""
    starts = block_starts(series.shape[-1], period)
    return np.moveaxis(np.add.reduceat(series, starts, axis=-1), -1, 0)


def block_weights(blocks: Sequence[int], seed: int, draws: int = DRAWS) -> NDArray:
    """How much each draw takes of each block, runs one after the other, (1 + draws, blocks).

    blocks: their number in each run, 2 or more. The first row takes each block once: the estimate. The
    weights' variance is 1, that of drawing with replacement freed of its bias n/(n - 1), times the
    square of Student's quantile over the normal one: few blocks tell their own scatter badly.
    """
    rng = np.random.default_rng(seed)
    tail = 0.5 + LEVEL / 2
    student = float(stats.t.ppf(tail, sum(blocks) - len(blocks)) / stats.norm.ppf(tail))
    drawn = [n * rng.dirichlet(np.full(n, _shape(n, student**2)), draws) for n in blocks]
    return np.vstack([np.ones(sum(blocks)), np.hstack(drawn)])


def _shape(n: int, variance: float) -> float:
    """Parameter of the Dirichlet distribution whose n shares, times n, have this variance."""
    return max(((n - 1) / variance - 1) / n, 0.05)


def interval(values: NDArray) -> Interval:
    """The first value is the estimate, the others its draws (percentile interval)."""
    low, high = np.quantile(values[1:], [0.5 - LEVEL / 2, 0.5 + LEVEL / 2])
    return Interval(value=float(values[0]), low=float(low), high=float(high))
