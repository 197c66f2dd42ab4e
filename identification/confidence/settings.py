"""What the intervals, the joint region and the check of the minimum are computed with (section 6.3)."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ConfidenceSettings:
    """Judgements of the confidence stage."""

    probability: float = 0.95
    """Of every interval and of the joint region."""
    input_draws: int = 8
    """Times that the noise of the inputs is drawn anew for each recording."""
    bootstrap_draws: int = 2000
    """Draws of the block bootstrap."""
    blocks_per_lag: int = 2
    """Length of the bootstrap's blocks, relative to the lags over which residuals are correlated."""
    gradient_step: float = 1e-5
    """Change of a scaled parameter for the gradient of the total error."""
    hessian_step: float = 1e-3
    """Change of a scaled parameter for the Hessian of the total error."""
    profile_half_width: float = 0.01
    """How far to either side a parameter is moved for its profile, relative."""
    profile_points: int = 41
    """Points of a profile."""
    flat: float = 1e-3
    """Largest possible decrease of the total error, relative to the error, at which the gradient counts
    as zero."""
    precise: float = 0.05
    """Half width of an interval, relative to the estimate, below which the estimate is precise."""


CONFIDENCE = ConfidenceSettings()
"""The default settings."""
