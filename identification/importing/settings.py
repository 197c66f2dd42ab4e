"""Judgements of the import: how channels come to one rate, and what a gap is."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ImportSettings:
    """The defaults suit benches that sample at 500 Hz to 100 kHz."""

    most_step: float = 1.75
    """Longest step over the usual one. A missing sample makes 2; jitter of a third of a period, 1.67."""
    resampling_margin: int = 4
    """Least density of the fine grid over a channel's own rate: the spline is smooth on it."""
    passband: float = 0.35
    """End of the passband over the lower of both rates; the switching of the coil stays sharp."""
    stopband: float = 0.5
    """Begin of the stopband over the lower of both rates: from Nyquist's frequency on nothing folds."""
    stop_attenuation: float = 70.0
    """Attenuation of what would fold [dB]: below a step of 12 bits."""
    same_time: float = 1e-3
    """Part of a period by which times may differ and count as the same samples."""
    greatest_rate: float = 20_000.0
    """Greatest rate of a campaign [1/s]; a faster bench is brought down to it. Valve and sensors are
    slower, and longer files only cost time."""


IMPORT = ImportSettings()
"""The default settings."""
