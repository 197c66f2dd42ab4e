"""Is the noise normal, white and independent of the other channels' (sections 4.2 to 4.4)?

The test of normality is one of grouped data, since a converter's readings are grouped.
Tests for continuous data see the steps of the converter, not the noise: with a step of 0.6 sigma and
10 000 samples they reject every normal signal. Here the counts per code are compared with the normal
probability of that code's bin.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, signal, special, stats
from statsmodels.stats.diagnostic import acorr_ljungbox
from statsmodels.tsa.stattools import acf, ccf

SIGNIFICANCE = 1e-4
"""Probability of a false alarm of one test; the 40 tests of a record stay below 1 % together."""
FIRST_LAGS = 10
"""Lags of the short Ljung-Box test, which finds dependence between neighbours [samples]."""
SPECTRUM_SEGMENT = 256
"""Samples per segment of Welch's method, at most an eighth of the record."""
LEAST_EXPECTED = 5.0
"""Counts that each bin of the chi-square test must be expected to hold; thinner bins are merged."""
MOST_CELLS = 10_000
"""Cells into which the readings of one channel are sorted for the chi-square test."""
MOST_POSITIONS = 500
"""Points along the trend, a quarter of sigma apart, over which a code's probability is averaged."""
CELLS_PER_SIGMA = 3.0
"""Codes finer than sigma over this number are merged, or the chi-square test loses its power."""


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


UNTESTED = Normality(
    standard_deviation=0.0,
    statistic=np.nan,
    degrees=0,
    probability=np.nan,
    effect=np.nan,
)
"""Of a signal that never changes."""


def assess_normality(readings: NDArray, line: NDArray, step: float) -> Normality:
    """Test raw readings about a line for normality; readings, line: (samples,), [unit].

    step: the converter's step [unit], 0 for continuous readings. The raw readings are tested, since
    taking the line off would smear the codes; the probability of a code is its mean along the line.
    """
    sigma = float(np.std(readings - line, ddof=1))
    edges, counts = _cells(readings, step, sigma)
    positions = _positions(line, sigma)
    shift, deviation = _fit(edges, counts, positions, sigma)
    expected = len(readings) * _probabilities(edges, positions + shift, deviation)
    return Normality(
        standard_deviation=deviation,
        **_chi_square(*_merged(counts, expected, LEAST_EXPECTED)),
    )


def _positions(line: NDArray, sigma: float) -> NDArray:
    """Midpoints of equal parts of the line; one point, unless the signal drifts."""
    drift = line[-1] - line[0]
    parts = min(MOST_POSITIONS, 1 + int(4 * abs(drift) / sigma))
    return line[0] + drift * (np.arange(parts) + 0.5) / parts


def _cells(readings: NDArray, step: float, sigma: float) -> tuple[NDArray, NDArray]:
    """Inner edges (cells - 1,) and counts (cells,) of cells of whole codes."""
    least = float(np.min(readings))
    step = step or 1e-3 * sigma
    codes = np.rint((readings - least) / step).astype(int)
    # Readings that drift by thousands of deviations need no more cells than this to show it.
    fewest = int(np.max(codes)) // MOST_CELLS + 1
    width = max(1, round(sigma / CELLS_PER_SIGMA / step), fewest)
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


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """Power spectral density by Welch's method (Figure 9)."""

    frequency: NDArray
    """Normalised, (frequencies,): 1 is the Nyquist frequency; without both ends."""
    density: NDArray
    """(frequencies,) [unit^2 per rad/sample]; sigma^2/pi for white noise."""
    white: float
    """sigma^2/pi."""
    band: tuple[float, float]
    """Between these lie 95 % of the densities of white noise."""


@dataclass(frozen=True, kw_only=True)
class WhitenessTest:
    """Whether a signal's samples are independent of each other."""

    autocorrelation: NDArray
    """At lags 0, 1, ..., (lags + 1,)."""
    probability: float
    """Of white noise, by Ljung-Box tests over 10 lags and over all (the lesser one, doubled)."""
    spectrum: Spectrum
    peak_frequency: float
    """Normalised frequency of the greatest power, by the periodogram of the whole record."""

    @property
    def peak(self) -> float:
        """Greatest magnitude of the autocorrelation at a lag other than 0."""
        return float(np.max(np.abs(self.autocorrelation[1:])))

    @property
    def inflation(self) -> float:
        """Variance of a mean relative to that with independent samples, 1 + 2 sum of all lags."""
        return float(1 + 2 * np.sum(self.autocorrelation[1:]))


@dataclass(frozen=True, kw_only=True)
class PairCorrelation:
    """How two signals depend on each other."""

    correlation: float
    """At lag 0 (Table 4)."""
    probability: float
    """Of a correlation at least as great without dependence, at lag 0."""
    crosscorrelation: NDArray
    """At lags -lags, ..., lags, (2 lags + 1,); at a positive lag the first signal follows."""
    effective_samples: float
    """Independent samples that would give the crosscorrelation the same variance (Bartlett)."""

    @property
    def peak(self) -> float:
        """Value of the greatest magnitude over all lags."""
        return float(self.crosscorrelation[np.argmax(np.abs(self.crosscorrelation))])

    @property
    def peak_lag(self) -> int:
        """Lag of the peak [samples]."""
        return int(np.argmax(np.abs(self.crosscorrelation))) - len(self.crosscorrelation) // 2

    @property
    def peak_probability(self) -> float:
        """Of a peak at least as great over all lags without dependence (Bonferroni)."""
        single = 2 * stats.norm.sf(abs(self.peak) * np.sqrt(self.effective_samples))
        return float(min(1.0, len(self.crosscorrelation) * single))


def white_noise_band(samples: float) -> float:
    """Half width of the band that holds 95 % of the correlations of independent white signals."""
    return float(stats.norm.isf(0.025) / np.sqrt(samples))


def assess_whiteness(residual: NDArray, lags: int) -> WhitenessTest:
    """Of a detrended signal (samples,), in any unit, that changes; lags: the greatest [samples]."""
    table = acorr_ljungbox(residual, lags=sorted({min(FIRST_LAGS, lags), lags}))
    frequency, power = signal.periodogram(residual, fs=2.0)
    return WhitenessTest(
        autocorrelation=np.asarray(acf(residual, nlags=lags, fft=True)),
        probability=float(min(1.0, 2 * np.min(table["lb_pvalue"]))),
        spectrum=spectrum(residual),
        peak_frequency=float(frequency[np.argmax(power)]),
    )


def assess_correlation(first: NDArray, second: NDArray, lags: int) -> PairCorrelation:
    """Of two detrended signals (samples,), in any unit, that change.

    lags: the greatest lag, either way [samples].
    """
    forward = np.asarray(ccf(first, second, adjusted=False, nlags=lags + 1))
    backward = np.asarray(ccf(second, first, adjusted=False, nlags=lags + 1))
    own = np.asarray(acf(first, nlags=lags, fft=True)) * np.asarray(acf(second, nlags=lags, fft=True))
    effective = len(first) / max(1.0, 1 + 2 * float(np.sum(own[1:])))
    correlation = float(forward[0])
    return PairCorrelation(
        correlation=correlation,
        probability=float(2 * stats.norm.sf(abs(correlation) * np.sqrt(effective))),
        crosscorrelation=np.concatenate((backward[:0:-1], forward)),
        effective_samples=effective,
    )


def spectrum(residual: NDArray) -> Spectrum:
    """Power density of a detrended signal (samples,) [unit], and the band of white noise.

    Welch's method with Hann windows that overlap by half.

    K such segments have 36 K^2/(19 K - 1) degrees of freedom (Percival and Walden 1993, chapter 6).
    """
    length = min(SPECTRUM_SEGMENT, len(residual) // 8)
    whole: Any = False  # the line is off already
    frequency, density = signal.welch(residual, fs=2.0, nperseg=length, detrend=whole)
    segments = (len(residual) - length) // (length - length // 2) + 1
    degrees = 36 * segments**2 / (19 * segments - 1)
    white = float(np.var(residual, ddof=1) / np.pi)
    low, high = white * stats.chi2.ppf([0.025, 0.975], degrees) / degrees
    return Spectrum(
        frequency=frequency[1:-1],
        density=density[1:-1] / np.pi,  # per rad/sample: Nyquist is pi
        white=white,
        band=(float(low), float(high)),
    )
