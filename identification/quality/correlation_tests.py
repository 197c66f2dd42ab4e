"""Do the samples depend on each other: auto- and cross-correlation, spectrum (sections 4.3, 4.4)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import signal, stats
from statsmodels.stats.diagnostic import acorr_ljungbox
from statsmodels.tsa.stattools import acf, ccf

from identification.quality.settings import QUALITY, QualitySettings


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


def assess_whiteness(residual: NDArray, lags: int, settings: QualitySettings = QUALITY) -> WhitenessTest:
    """Of a detrended signal (samples,), in any unit, that changes; lags: the greatest [samples]."""
    table = acorr_ljungbox(residual, lags=sorted({min(settings.first_lags, lags), lags}))
    frequency, power = signal.periodogram(residual, fs=2.0)
    return WhitenessTest(
        autocorrelation=np.asarray(acf(residual, nlags=lags, fft=True)),
        probability=float(min(1.0, 2 * np.min(table["lb_pvalue"]))),
        spectrum=spectrum(residual, settings),
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


def spectrum(residual: NDArray, settings: QualitySettings = QUALITY) -> Spectrum:
    """Power density of a detrended signal (samples,) [unit], and the band of white noise.

    Welch's method with Hann windows that overlap by half.

    K such segments have 36 K^2/(19 K - 1) degrees of freedom (Percival and Walden 1993, chapter 6).
    """
    length = min(settings.spectrum_segment, len(residual) // 8)
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
