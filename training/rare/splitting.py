"""How rarely a function of standard normal numbers exceeds a level: multilevel splitting.

An episode is a deterministic function of all random numbers behind it: plant, pressures, consumption and
noise. Splitting therefore acts on these numbers, and not on the state of a simulation that goes on with
fresh noise. The reasons:

- What is drawn once per episode can change. A copy of a simulation would keep its parent's plant, and a
  rare plant that is not among the first draws could never be met.
- Every move of the numbers leaves their distribution as it was, so the estimate has no bias for whatever
  fixed thresholds and however well the moves mix.
- Nothing of an environment or a controller has to be copied.

The particles above a threshold are the ancestors of chains that stay above it (Metropolis et al. with
the moves of `Moves`); all states of the chains are the particles of the next threshold. This is subset
simulation, Au and Beck, Probabilistic Engineering Mechanics 16 (2001), in the form of waste-free
sequential Monte Carlo, Dau and Chopin, J. Royal Statistical Society B 84 (2022), which shows that the
product of the shares is unbiased. Thresholds that adapt to the particles would bias it (Brehier,
Lelievre and Rousset, ESAIM: Probability and Statistics 19 (2015)), and so would assumed shares where
levels tie: a run of its own finds the thresholds, and the others count. Independent repetitions give
the interval.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

Level = Callable[[NDArray], NDArray]
"""From normals (n, numbers) to levels (n,); infinite beyond all thresholds."""

CHAIN = 8
"""States of a chain: an eighth of the particles lies above the next threshold."""
SMALLEST_STEP, SMALLEST_SHARE, SHORTEST_SPAN = 0.3, 0.2, 0.05
"""Least size of a move, where 1 draws anew, least share of the numbers drawn once that it changes, and
shortest span of those in time [1]. Smaller moves are accepted more often, and lead less far."""
MOST_THRESHOLDS = 40
"""More are needed for nothing that can be measured; levels that no longer rise end there."""


@dataclass(frozen=True, kw_only=True)
class Moves:
    """Random changes of the numbers under which their distribution stays: standard normal."""

    drawn: int
    """Numbers at the front of which every move may change any."""
    in_time: int = 0
    """Numbers behind them that follow each other in time: a move changes a span of them."""

    def __call__(self, normals: NDArray, rng: np.random.Generator) -> NDArray:
        """Changed numbers (n, drawn + in_time).

        A preconditioned Crank-Nicolson step (Cotter et al., Statistical Science 28 (2013)) of those that
        a row's move touches. Which and how far is drawn without regard to their values.
        """
        n = len(normals)
        step = SMALLEST_STEP ** rng.random((n, 1))
        touched = np.zeros(normals.shape, dtype=bool)
        kinds = 3 if self.drawn and self.in_time else 1
        which = 2 - rng.integers(kinds, size=(n, 1))  # 2: both, 1: a span, 0: numbers drawn once
        front = rng.random((n, self.drawn)) < SMALLEST_SHARE ** rng.random((n, 1))
        touched[:, : self.drawn] = front & (which != 1)
        if self.in_time:
            length = self.in_time * SHORTEST_SPAN ** rng.random((n, 1))
            since = np.arange(self.in_time) - rng.integers(self.in_time, size=(n, 1))
            touched[:, self.drawn :] = (since % self.in_time < length) & (which != 0)
        fresh = rng.standard_normal(normals.shape)
        return np.where(touched, np.sqrt(1 - step**2) * normals + step * fresh, normals)


@dataclass(frozen=True, kw_only=True)
class Splitting:
    """One repetition."""

    shares: list[float]
    """Of the particles that lie above each threshold, of those above the one before [1]."""
    runs: int
    """Evaluations of the level."""
    rare: NDArray
    """Normals above the last threshold (particles, numbers)."""

    @property
    def probability(self) -> float:
        """Unbiased estimate that the level exceeds the last threshold."""
        return float(np.prod(self.shares))


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A level, and how its numbers move."""

    level: Level
    moves: Moves
    particles: int = 512
    """At each threshold, a multiple of CHAIN."""

    def _first(self, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
        normals = rng.standard_normal((self.particles, self.moves.drawn + self.moves.in_time))
        return normals, self.level(normals)

    def _next(
        self, normals: NDArray, levels: NDArray, threshold: float, rng: np.random.Generator
    ) -> tuple[NDArray, NDArray]:
        """Particles above a threshold from those that are there, at least one."""
        # Every one that is there begins as many chains, but for one.
        above = np.resize(rng.permutation(np.flatnonzero(levels > threshold)), self.particles // CHAIN)
        states = [(normals[above], levels[above])]
        for _ in range(CHAIN - 1):
            before, level = states[-1]
            changed = self.moves(before, rng)
            reached = self.level(changed)
            accepted = reached > threshold
            states.append(
                (np.where(accepted[:, None], changed, before), np.where(accepted, reached, level))
            )
        rows, values = zip(*states, strict=True)
        return np.concatenate(rows), np.concatenate(values)

    def thresholds(self, last: float, least: float, rng: np.random.Generator) -> list[float]:
        """Thresholds up to `last`, of which one particle in CHAIN exceeds the next.

        They end below `last` where the probability falls below `least`, or where all levels are equal.
        """
        normals, levels = self._first(rng)
        found: list[float] = []
        probability = 1.0
        while len(found) < MOST_THRESHOLDS and probability >= least:
            wanted = np.sort(levels)[-self.particles // CHAIN - 1]
            lower = levels[levels < levels.max()]
            if wanted >= last or not len(lower):
                return [*found, last] if wanted >= last else found
            found.append(float(min(wanted, lower.max())))  # ties must not leave none above
            probability *= np.mean(levels > found[-1])
            normals, levels = self._next(normals, levels, found[-1], rng)
        return found

    def repetition(self, thresholds: Sequence[float], rng: np.random.Generator) -> Splitting:
        """One estimate with thresholds that do not depend on its particles."""
        normals, levels = self._first(rng)
        shares, runs = [], self.particles
        for k, threshold in enumerate(thresholds):
            shares.append(float(np.mean(levels > threshold)))
            if shares[-1] == 0.0:
                shares += [0.0] * (len(thresholds) - len(shares))
                break
            if k + 1 < len(thresholds):
                normals, levels = self._next(normals, levels, threshold, rng)
                runs += self.particles // CHAIN * (CHAIN - 1)
        return Splitting(shares=shares, runs=runs, rare=normals[levels > thresholds[-1]])


def interval(estimates: NDArray, confidence: float = 0.95) -> tuple[float, float]:
    """Interval of the mean of independent estimates (repetitions,), within 0 to 1.

    The estimates are skewed, like a lognormal variable. So the interval is Cox's, of a lognormal mean
    (Zhou and Gao, Statistics in Medicine 16 (1997)), with Student's quantile. Where an estimate is 0 it
    is Student's of the mean.
    """
    n = len(estimates)
    quantile = float(student.ppf((1 + confidence) / 2, n - 1))
    if np.all(estimates > 0):
        logs = np.log(estimates)
        variance = float(np.var(logs, ddof=1))
        reach = quantile * np.sqrt(variance / n + variance**2 / (2 * (n - 1)))
        low, high = np.exp(logs.mean() + variance / 2 + np.array([-reach, reach]))
        return float(low), float(min(high, 1.0))
    reach = quantile * float(np.std(estimates, ddof=1)) / np.sqrt(n)
    low, high = np.clip(estimates.mean() + np.array([-reach, reach]), 0.0, 1.0)
    return float(low), float(high)
