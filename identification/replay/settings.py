"""What the replay smooths inputs with, and steps and batches its simulations by."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ReplaySettings:
    """Judgements of the replay of recordings."""

    smoothing_window: float = 0.01
    """Window in which p2 is smoothed before the air drawn from the supply is read off p2 [s]."""
    block: float = 0.02
    """Length of the blocks over which what remains of a signal must average out [s]."""
    white_probability: float = 1e-4
    """Probability, as white noise, of what remains of a signal below which the signal is not replaced
    by a simple course."""
    rounding_margin: float = 1.4
    """Scatter over a rounding error up to which rounding explains what remains of a signal: readings
    that waver between two codes reach 1.7, and the noise of fine steps lies far beyond."""
    pressure_step: float = 1e3
    """Change of the start's circuit pressure by which its influence is measured [Pa]."""
    relative_step: float = 1e-4
    """Change of a scaled parameter for a finite difference."""
    failed_residual: float = 1e3
    """Residual, in units of its weight, of samples of a candidate that cannot be integrated."""
    largest_batch: int = 1_500_000
    """Samples times valves that are simulated at once: about 40 MB of outputs."""
    recorded_periods: int = 100
    """Sampling periods whose states are kept at a time: few enough to stay in the processor's cache."""


REPLAY = ReplaySettings()
"""The default settings."""
