"""Is the noise normal (section 4.2)? A test of grouped data, since a converter's readings are grouped.

Tests for continuous data see the steps of the converter, not the noise: with a step of 0.6 sigma and
10 000 samples they reject every normal signal. Here the counts per code are compared with the normal
probability of that code's bin.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special, stats
from statsmodels.stats.diagnostic import normal_ad
from statsmodels.stats.stattools import jarque_bera

from identification.quality.settings import QUALITY, QualitySettings

ESTIMATED = 2
"""Parameters estimated from the counts: mean and standard deviation."""


@dataclass(frozen=True, kw_only=True)
class Normality:
    """What the counts per code say about a normal distribution."""

    standard_deviation: float
    """Of the noise before rounding, by maximum likelihood of the grouped counts [unit]."""
    statistic: float
    """Pearson's chi-square over the merged bins."""
    degrees: int
    """Degrees of freedom: bins - 1 - estimated parameters; below 1 the test cannot be made."""
    probability: float
    """Of a statistic at least as great for normal noise; NaN if the test cannot be made."""
    effect: float
    """Cohen's w, sqrt((statistic - degrees)/n): departure from normal, whatever the sample size."""
    naive_anderson_darling: float
    """p-value of the Anderson-Darling test, which takes the readings for continuous."""
    naive_jarque_bera: float
    """p-value of the Jarque-Bera test of skewness and kurtosis."""


UNTESTED = Normality(
    standard_deviation=0.0,
    statistic=np.nan,
    degrees=0,
    probability=np.nan,
    effect=np.nan,
    naive_anderson_darling=np.nan,
    naive_jarque_bera=np.nan,
)
"""Of a signal that never changes."""


def assess_normality(
    readings: NDArray, line: NDArray, step: float, settings: QualitySettings = QUALITY
) -> Normality:
    """Test raw readings about a line for normality; readings, line: (samples,), [unit].

    step: the converter's step [unit], 0 for continuous readings. The raw readings are tested, since
    taking the line off would smear the codes; the probability of a code is its mean along the line.
    """
    sigma = float(np.std(readings - line, ddof=1))
    edges, counts = _cells(readings, step, sigma, settings)
    positions = _positions(line, sigma, settings)
    shift, deviation = _fit(edges, counts, positions, sigma)
    expected = len(readings) * _probabilities(edges, positions + shift, deviation)
    with np.errstate(
        divide="ignore"
    ):  # a reading so far out that its probability is 0 in double precision
        anderson_darling = float(normal_ad(readings - line)[1])
    return Normality(
        standard_deviation=deviation,
        naive_anderson_darling=anderson_darling,
        naive_jarque_bera=float(jarque_bera(readings - line)[1]),
        **_chi_square(*_merged(counts, expected, settings.least_expected)),
    )


def probability_plot(residual: NDArray) -> tuple[NDArray, NDArray, float, float]:
    """Normal quantiles and ordered values of a signal [unit], (samples,) each; their line.

    The line is given by its slope and its offset [unit].
    """
    plot: Any = stats.probplot(residual)
    (quantiles, ordered), (slope, offset, _) = plot
    return quantiles, ordered, slope, offset


def _positions(line: NDArray, sigma: float, settings: QualitySettings) -> NDArray:
    """Midpoints of equal parts of the line; one point, unless the signal drifts."""
    drift = line[-1] - line[0]
    parts = min(settings.most_positions, 1 + int(4 * abs(drift) / sigma))
    return line[0] + drift * (np.arange(parts) + 0.5) / parts


def _cells(
    readings: NDArray, step: float, sigma: float, settings: QualitySettings
) -> tuple[NDArray, NDArray]:
    """Inner edges (cells - 1,) and counts (cells,) of cells of whole codes."""
    least = float(np.min(readings))
    step = step or 1e-3 * sigma
    codes = np.rint((readings - least) / step).astype(int)
    # Readings that drift by thousands of deviations need no more cells than this to show it.
    fewest = int(np.max(codes)) // settings.most_cells + 1
    width = max(1, round(sigma / settings.cells_per_sigma / step), fewest)
    counts = np.bincount(codes // width)
    return least + (width * np.arange(1, len(counts)) - 0.5) * step, counts


def _probabilities(edges: NDArray, positions: NDArray, deviation: float) -> NDArray:
    """Probability of each cell for a normal signal whose mean passes through the positions."""
    below = special.ndtr((edges[:, None] - positions) / deviation).mean(axis=1)
    return np.diff(np.concatenate(([0.0], below, [1.0])))


def _fit(edges: NDArray, counts: NDArray, positions: NDArray, sigma: float) -> tuple[float, float]:
    """Shift against the line and standard deviation of the greatest likelihood [unit]."""

    def loss(guess: NDArray) -> float:
        moved = positions + guess[0] * sigma
        probabilities = _probabilities(edges, moved, sigma * np.exp(guess[1]))
        return -float(counts @ np.log(np.maximum(probabilities, 1e-300))) / np.sum(counts)

    shift, growth = optimize.minimize(loss, np.zeros(2), method="Nelder-Mead").x
    return float(shift * sigma), float(sigma * np.exp(growth))


def _merged(counts: NDArray, expected: NDArray, least: float) -> tuple[NDArray, NDArray]:
    """Neighbouring cells taken together until each is expected to hold enough."""
    starts, filled = [0], 0.0
    for cell, value in enumerate(expected[:-1]):
        filled += value
        if filled >= least and np.sum(expected[cell + 1 :]) >= least:
            starts.append(cell + 1)
            filled = 0.0
    return np.add.reduceat(counts, starts), np.add.reduceat(expected, starts)


def _chi_square(counts: NDArray, expected: NDArray) -> dict:
    degrees = len(counts) - 1 - ESTIMATED
    if degrees < 1:
        return {"statistic": np.nan, "degrees": degrees, "probability": np.nan, "effect": np.nan}
    statistic, probability = stats.chisquare(counts, expected, ddof=ESTIMATED)
    effect = np.sqrt(max(0.0, statistic - degrees) / np.sum(counts))
    return {
        "statistic": float(statistic),
        "degrees": degrees,
        "probability": float(probability),
        "effect": float(effect),
    }
