"""Expected information of an experiment whose outcome each rival predicts as a Gaussian."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import log_softmax


@dataclass(frozen=True, kw_only=True)
class InformationGain:
    """What one experiment is expected to tell about n rivals."""

    expected_probability: tuple[float, ...]
    """Expected probability of each rival after the experiment, if that rival is right, (n,)."""
    expected_best: float
    """Expected probability, after the experiment, of the rival that is then the most probable."""
    expected_entropy: float
    """Expected entropy of the rivals' probabilities after the experiment [nats]."""
    log_bayes_factor: NDArray
    """Expected log Bayes factor of the right rival (row) against another (column), (n, n) [nats]."""

    @property
    def sort_key(self) -> tuple[float, float]:
        """Lower is better: the entropy; where none is left, the pair that is hardest to tell apart."""
        n = len(self.expected_probability)
        of_pairs = self.log_bayes_factor + np.diag(np.full(n, np.inf))
        return self.expected_entropy, -float(np.min(of_pairs))


def information_gain(
    means: NDArray, covariances: NDArray, probability: Sequence[float], outcomes: int
) -> InformationGain:
    """Expected information by simulated outcomes, in antithetic pairs.

    Args:
        means: of each rival's Gaussian, (rivals, d) [1].
        covariances: of each rival's Gaussian, (rivals, d, d) [1].
        probability: of each rival before the experiment, (rivals,).
        outcomes: number of simulated outcomes of each rival.
    """
    prior = np.array(probability)
    n, d = means.shape
    factors = np.linalg.cholesky(covariances)
    noise = np.random.default_rng(0).standard_normal((outcomes // 2, d))
    log_after = np.empty((n, 2 * len(noise), n))
    for right in range(n):
        spread = noise @ factors[right].T
        simulated = means[right] + np.concatenate([spread, -spread])
        likelihoods = [
            log_density(simulated - mean, factor) for mean, factor in zip(means, factors, strict=True)
        ]
        weighed = np.stack(likelihoods, axis=1) + np.log(np.maximum(prior, np.finfo(float).tiny))
        log_after[right] = log_softmax(weighed, axis=1)
    own = log_after[np.arange(n), :, np.arange(n)]
    return InformationGain(
        expected_probability=tuple(np.mean(np.exp(own), axis=1).tolist()),
        expected_best=float(prior @ np.mean(np.exp(np.max(log_after, axis=2)), axis=1)),
        expected_entropy=float(-prior @ np.mean(own, axis=1)),
        log_bayes_factor=kullback_leibler_divergences(means, factors),
    )


def log_density(deviations: NDArray, factor: NDArray) -> NDArray:
    """Log density of a Gaussian but for a constant, (draws,) [nats].

    deviations: from the mean, (draws, d) [1]. factor: Cholesky factor of the covariance, (d, d) [1].
    """
    white = solve_triangular(factor, deviations.T, lower=True)
    return -0.5 * np.sum(white**2, axis=0) - np.sum(np.log(np.diag(factor)))


def kullback_leibler_divergences(means: NDArray, factors: NDArray) -> NDArray:
    """Divergences of Gaussians, of each (row) from each other (column), (n, n) [nats].

    means: (n, d) [1]. factors: Cholesky factors of the covariances, (n, d, d) [1].
    """
    n, d = means.shape
    divergences = np.zeros((n, n))
    for right in range(n):
        for other in range(n):
            spread = solve_triangular(factors[other], factors[right], lower=True)
            of_mean = log_density((means[right] - means[other])[None], factors[other])[0]
            own = -np.sum(np.log(np.diag(factors[right])))
            divergences[right, other] = own - of_mean + 0.5 * (np.sum(spread**2) - d)
    return divergences


def odds_text(probability: float) -> str:
    """A probability as odds in a hundred: 98:2."""
    if probability > 0.99:
        return "better than 99:1"
    return f"{round(100 * probability)}:{100 - round(100 * probability)}"
