"""What an experiment promises whose outcome each rival predicts as a Gaussian."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import log_softmax

DRAWS = 1000
"""Outcomes by each rival over which an experiment's promise is averaged."""


@dataclass(frozen=True, kw_only=True)
class Outlook:
    """What one experiment promises."""

    after: tuple[float, ...]
    """Expected probability of each rival afterwards, if it is the right one."""
    best: float
    """Expected probability, afterwards, of the rival that is then the most probable."""
    doubt: float
    """Expected entropy of the rivals' probabilities afterwards [nats]."""
    log_bayes_factor: NDArray
    """Expected log Bayes factor of the right one (row) against another (column), (rivals, rivals)."""

    @property
    def rank(self) -> tuple[float, float]:
        """The less the better: the doubt; where none is left, the pair that is the hardest to split."""
        apart = self.log_bayes_factor + np.diag(np.full(len(self.after), np.inf))
        return self.doubt, -float(np.min(apart))


def outlook(means: NDArray, covariances: NDArray, probability: Sequence[float]) -> Outlook:
    """What an experiment promises whose outcome each rival predicts as a Gaussian (rivals, d)."""
    prior = np.array(probability)
    n, d = means.shape
    factors = np.linalg.cholesky(covariances)
    noise = np.random.default_rng(0).standard_normal((DRAWS // 2, d))
    log_after = np.empty((n, 2 * len(noise), n))
    for right in range(n):
        spread = noise @ factors[right].T
        outcomes = means[right] + np.concatenate([spread, -spread])
        likelihoods = [
            log_density(outcomes - mean, factor) for mean, factor in zip(means, factors, strict=True)
        ]
        weighed = np.stack(likelihoods, axis=1) + np.log(np.maximum(prior, np.finfo(float).tiny))
        log_after[right] = log_softmax(weighed, axis=1)
    own = log_after[np.arange(n), :, np.arange(n)]
    return Outlook(
        after=tuple(np.mean(np.exp(own), axis=1).tolist()),
        best=float(prior @ np.mean(np.exp(np.max(log_after, axis=2)), axis=1)),
        doubt=float(-prior @ np.mean(own, axis=1)),
        log_bayes_factor=divergences(means, factors),
    )


def log_density(deviations: NDArray, factor: NDArray) -> NDArray:
    """Of deviations (draws, d) from a mean, but for a constant, (draws,); factor: Cholesky's."""
    white = solve_triangular(factor, deviations.T, lower=True)
    return -0.5 * np.sum(white**2, axis=0) - np.sum(np.log(np.diag(factor)))


def divergences(means: NDArray, factors: NDArray) -> NDArray:
    """Kullback-Leibler divergences of Gaussians, of each (row) from each other (column)."""
    n, d = means.shape
    found = np.zeros((n, n))
    for right in range(n):
        for other in range(n):
            spread = solve_triangular(factors[other], factors[right], lower=True)
            apart = log_density((means[right] - means[other])[None], factors[other])[0]
            own = -np.sum(np.log(np.diag(factors[right])))
            found[right, other] = own - apart + 0.5 * (np.sum(spread**2) - d)
    return found


def odds(probability: float) -> str:
    """A probability as odds in a hundred: 98:2."""
    if probability > 0.99:
        return "better than 99:1"
    return f"{round(100 * probability)}:{100 - round(100 * probability)}"
