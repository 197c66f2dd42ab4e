"""Splitting where the probability is known: how often its interval holds the truth."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.special import ndtr
from scipy.stats import norm

from training.rare.splitting import Moves, Problem, interval

MEMORY, SAMPLES = 0.9, 50
"""Correlation of neighbouring samples of the Ornstein-Uhlenbeck process, and their number."""
UP, STEPS = 0.3, 80
"""Probability of a birth, and steps of the birth-death chain: it dies out long before."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """A level and the probability that it exceeds a threshold."""

    level: Callable[[NDArray], NDArray]
    moves: Moves
    threshold: float
    truth: float

    def estimates(self, seed: int, *, particles: int, repetitions: int) -> NDArray:
        """Independent estimates (repetitions,), with thresholds from a run of their own."""
        problem = Problem(level=self.level, moves=self.moves, particles=particles)
        found = problem.thresholds(self.threshold, 1e-9, np.random.default_rng([seed, 0]))
        return np.array([
            problem.repetition(found, np.random.default_rng([seed, 1 + k])).probability
            for k in range(repetitions)
        ])  # fmt: skip


def largest_sample(normals: NDArray) -> NDArray:
    """Maximum (n,) of a stationary Ornstein-Uhlenbeck process of variance 1; normals (n, SAMPLES)."""
    innovations = np.sqrt(1 - MEMORY**2) * normals
    innovations[:, 0] = normals[:, 0]
    return np.asarray(lfilter([1.0], [1.0, -MEMORY], innovations, axis=1)).max(axis=1)


def crossing(threshold: float) -> float:
    """Probability that a sample lies above: the density below is integrated from sample to sample."""
    nodes, weights = np.polynomial.legendre.leggauss(300)
    low = -7.0
    nodes = low + (threshold - low) * (nodes + 1) / 2
    weights = weights * (threshold - low) / 2
    spread = np.sqrt(1 - MEMORY**2)
    kernel = norm.pdf(nodes[:, None], MEMORY * nodes, spread) * weights
    density = norm.pdf(nodes)
    for _ in range(SAMPLES - 1):
        density = kernel @ density
    return float(1 - weights @ density)


def largest_population(normals: NDArray) -> NDArray:
    """Maximum (n,) of a birth-death chain that begins with 1 and ends at 0; normals (n, STEPS)."""
    population = 1 + np.cumsum(np.where(ndtr(normals) < UP, 1, -1), axis=1)
    alive = np.minimum.accumulate(population, axis=1) > 0
    return np.maximum(np.max(population * alive, axis=1), 1).astype(float)


def ruin(population: int) -> float:
    """Probability that the chain reaches a population before 0: the gambler's ruin."""
    odds = (1 - UP) / UP
    return (odds - 1) / (odds**population - 1)


CASES = {
    "normal tail": Case(
        level=lambda normals: normals.sum(axis=1) / np.sqrt(normals.shape[1]),
        moves=Moves(drawn=10), threshold=4.0, truth=float(norm.sf(4.0)),
    ),
    "Ornstein-Uhlenbeck crossing": Case(
        level=largest_sample, moves=Moves(drawn=0, in_time=SAMPLES), threshold=4.3,
        truth=crossing(4.3),
    ),
    "birth-death chain": Case(
        level=largest_population, moves=Moves(drawn=0, in_time=STEPS), threshold=7.5, truth=ruin(8),
    ),
}  # fmt: skip
"""By what is exceeded; populations tie, as levels of episodes may."""


def coverage(case: Case, *, trials: int, particles: int, repetitions: int) -> tuple[int, float]:
    """Trials whose interval holds the truth, and the mean of all estimates over the truth."""
    hits, means = 0, []
    for seed in range(trials):
        estimates = case.estimates(seed, particles=particles, repetitions=repetitions)
        low, high = interval(estimates)
        hits += low <= case.truth <= high
        means.append(estimates.mean())
    return hits, float(np.mean(means)) / case.truth
