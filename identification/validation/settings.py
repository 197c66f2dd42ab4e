"""What the validation judges the residuals of the held-out recordings by (section 7)."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ValidationSettings:
    """Judgements of the validation stage."""

    greatest_lag: float = 0.05
    """Greatest lag of the residuals' autocorrelation [s], at most a fifth of the recording."""
    white: float = 1e-4
    """Probability of white noise below which a residual is called predictable."""
    explained: float = 1.2
    """Root mean square residual, in noise deviations, up to which next to nothing is left to explain."""
    accepted_error: float = 0.1
    """Partial error that the report accepts (section 7), a fraction."""


VALIDATION = ValidationSettings()
"""The default settings."""
