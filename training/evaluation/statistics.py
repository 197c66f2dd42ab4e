"""Statistics of a comparison: interquartile mean, stratified bootstrap, paired differences.

After Agarwal et al., "Deep Reinforcement Learning at the Edge of the Statistical Precipice" (NeurIPS
2021), whose matrix of scores has a row per training run and a column per task. Here the tasks are the
scenarios, and the episodes behind each score are kept, because controllers meet the same ones (common
random numbers): scores have the shape (seeds, scenarios, episodes). A classic controller has one row
and so no seed variance; its intervals come from the episodes alone.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap, trim_mean


@dataclass(frozen=True, kw_only=True)
class BootstrapSettings:
    """Size of the bootstrap."""

    resamples: int = 2000
    """Number of resamples behind each interval."""
    confidence: float = 0.95
    """Level of the intervals [1]."""
    batch_values: int = 4_000_000
    """Values that a bootstrap draws at a time: bounds its memory."""


Statistic = Callable[[NDArray], NDArray]
"""From score matrices (resamples, seeds, scenarios) to figures (resamples,)."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A figure and its bootstrap interval."""

    value: float
    low: float
    """Lower end of the interval."""
    high: float
    """Upper end of the interval."""


def interquartile_mean(scores: NDArray) -> NDArray:
    """Interquartile mean of each matrix of scores (resamples, seeds, scenarios): (resamples,).

    The mean of the middle half of all entries: less jumpy than a median, deaf to single outliers.
    """
    return trim_mean(scores.reshape(len(scores), -1), 0.25, axis=1)


def mean(scores: NDArray) -> NDArray:
    """Mean of each matrix of scores, shape as for `interquartile_mean`."""
    return scores.reshape(len(scores), -1).mean(axis=1)


def bootstrap_estimate(
    scores: NDArray,
    statistic: Statistic = interquartile_mean,
    *,
    settings: BootstrapSettings = BootstrapSettings(),
    seed: int = 0,
) -> Estimate:
    """A statistic of scores with its percentile bootstrap interval.

    The bootstrap is stratified: every scenario keeps its number of seeds and of episodes. The seeds are
    drawn anew with replacement within each scenario, and so are its episodes, the same ones for every
    seed (scipy.stats.bootstrap has no such nested resampling).

    Args:
        scores: (seeds, scenarios, episodes).
        statistic: of the matrix of mean scores (seeds, scenarios).
        settings: size of the bootstrap.
        seed: of the resampling.
    """
    resampled = statistic(_resampled(scores, seed, settings.resamples))
    tails = [(1 - settings.confidence) / 2, (1 + settings.confidence) / 2]
    low, high = np.quantile(resampled, tails)
    value = statistic(scores.mean(axis=2)[None])[0]
    return Estimate(value=float(value), low=float(low), high=float(high))


def _resampled(scores: NDArray, seed: int, resamples: int) -> NDArray:
    """Matrices of scores, their episodes and seeds drawn anew: (resamples, seeds, scenarios)."""
    seeds, scenarios, episodes = scores.shape
    weights = _episode_weights(seed, resamples, scenarios, episodes)
    means = np.einsum("kse,rse->rks", scores, weights, optimize=True)
    chosen = np.random.default_rng((seed, 1)).integers(seeds, size=(resamples, seeds, scenarios))
    return np.take_along_axis(means, chosen, axis=1)


@lru_cache(maxsize=4)
def _episode_weights(seed: int, resamples: int, scenarios: int, episodes: int) -> NDArray:
    """How often each episode is drawn, over their number; kept, since every figure uses the same."""
    rng = np.random.default_rng((seed, 0))
    drawn = rng.multinomial(episodes, np.full(episodes, 1 / episodes), (resamples, scenarios))
    return drawn / episodes


def paired_difference(ours: NDArray, theirs: NDArray) -> Estimate:
    """Mean of ours - theirs, episode by episode under the same random numbers.

    Scores (seeds, scenarios, episodes) of the same scenarios; one side may have a single row (a classic
    controller), otherwise run k meets run k. Where one has fewer episodes, its own are compared.
    """
    return bootstrap_estimate(_paired(ours, theirs, np.subtract), mean)


def probability_of_improvement(ours: NDArray, theirs: NDArray, *, lower_is_better: bool) -> Estimate:
    """Probability that our score is the better one in an episode that both meet; ties count half.

    The mean over scenarios, as in Agarwal et al. (eq. 1), but paired. Shapes as for `paired_difference`.
    """

    def better(a: NDArray, b: NDArray) -> NDArray:
        return (a < b) + 0.5 * (a == b)

    pair = (ours, theirs) if lower_is_better else (theirs, ours)
    return bootstrap_estimate(_paired(*pair, better), mean)


def _paired(a: NDArray, b: NDArray, compare: Callable[[NDArray, NDArray], NDArray]) -> NDArray:
    """compare(a, b) on the episodes that both have (each controller's first ones)."""
    common = min(a.shape[2], b.shape[2])
    if a.shape[1] != b.shape[1] or not (a.shape[0] == b.shape[0] or 1 in (a.shape[0], b.shape[0])):
        raise ValueError(
            f"scores of shapes {a.shape} and {b.shape} cannot be paired: give the same scenarios, and "
            "equal numbers of seeds or one"
        )
    return compare(a[:, :, :common], b[:, :, :common])


def mean_interval(
    values: NDArray, settings: BootstrapSettings = BootstrapSettings()
) -> tuple[float, float]:
    """Ends of the percentile bootstrap interval of a mean of values (n,)."""
    if np.ptp(values) == 0:
        return float(values[0]), float(values[0])
    interval = bootstrap(
        (values,), np.mean, n_resamples=settings.resamples, confidence_level=settings.confidence,
        method="percentile", rng=np.random.default_rng(0),
        batch=max(settings.batch_values // len(values), 1),
    ).confidence_interval  # fmt: skip
    return float(interval.low), float(interval.high)


def pareto_front(points: Iterable[tuple[float, ...]]) -> list[bool]:
    """Which points are dominated by no other; every coordinate is better when it is lower."""
    rows = np.array(list(points), dtype=float)
    no_worse = np.all(rows[:, None] <= rows[None], axis=2)
    better = np.any(rows[:, None] < rows[None], axis=2)
    return [not bool(np.any(column)) for column in (no_worse & better).T]
