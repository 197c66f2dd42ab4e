"""What the assessment of a steady recording judges by: sample counts, tests and levels (section 4)."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class QualitySettings:
    """Judgements of the quality stage; the defaults pass a perfect bench in 99 % of records or more."""

    least_samples: int = 250
    """Shortest record [samples]: half a second at 500 Hz. Fewer do not show the noise's distribution."""
    greatest_lag: float = 0.1
    """Greatest lag of the correlations [s].

    With more lags for the samples, the Ljung-Box test alarms too often on white noise; see
    `samples_per_lag`.
    """
    samples_per_lag: int = 20
    """Samples that a record needs for each lag of the correlations."""
    significance: float = 1e-4
    """Probability of a false alarm of one test; the 40 tests of a record stay below 1 % together."""
    first_lags: int = 10
    """Lags of the short Ljung-Box test, which finds dependence between neighbours [samples]."""
    spectrum_segment: int = 256
    """Samples per segment of Welch's method, at most an eighth of the record."""
    least_expected: float = 5.0
    """Counts that each bin of the chi-square test must be expected to hold; thinner bins are merged."""
    most_cells: int = 10_000
    """Cells into which the readings of one channel are sorted for the chi-square test."""
    most_positions: int = 500
    """Points along the trend, a quarter of sigma apart, over which a code's probability is averaged."""
    cells_per_sigma: float = 3.0
    """Codes finer than sigma over this number are merged, or the chi-square test loses its power."""
    drift_levels: tuple[float, float] = (0.1, 1.0)
    """Drift over the record, relative to Table 1's accuracy, from which it is in doubt, and bad."""
    noise_levels: tuple[float, float] = (1.5, 4.0)
    """Standard deviation relative to Table 3's: 3.5 dB and 12 dB of its signal-to-noise ratio."""
    quiet_levels: tuple[float, float] = (5.0, 30.0)
    """Table 3's standard deviation relative to the record's, from which the noise is too small for a
    sensor of this kind: a reading 100 times too small is as quiet."""
    outlier_levels: tuple[float, float] = (1.0, 2.0)
    """Outlier factor (eq. 18) relative to its limit."""
    outlier_confidence: float = 0.999
    """Share of normal records whose greatest outlier stays below the limit."""
    coarse_step: float = 1.1
    """Converter step relative to Table 1's twelve bits from which the converter is too coarse."""
    least_dither: float = 0.3
    """Noise in converter steps below which rounding errors no longer average out."""
    effect_levels: tuple[float, float] = (0.1, 0.3)
    """Cohen's small and medium effects: of w for normality, of correlations otherwise."""
    inflation_levels: tuple[float, float] = (3.0, 10.0)
    """Variance of a mean relative to that with independent samples."""


QUALITY = QualitySettings()
"""The default settings."""
