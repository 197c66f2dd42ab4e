"""Judgements by which the diagnosis describes the valve, with their units and reasons."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ValveSettings:
    """How the valve's recordings, regimes, parameters and experiments are judged."""

    time_scale: float = 5e-3
    """How long the fastest transients last [s]: the armature's flight, the decay of the current."""
    noise_block: float = 0.02
    """Length of the stretches of which each has its own estimate of the noise [s]: 40 samples."""
    switching_transient: float = 0.02
    """Time after a switching that the noise estimate leaves out [s]: the coil and p3 move."""
    parameter_scatter: float = 3e-3
    """Relative standard deviation, between units, of the parameters that are not calibrated [-]."""
    parameter_range: float = 0.1
    """Share by which such a parameter may be off [-]: Tables 8 and 9 vary them so far."""
    parameter_trials: tuple[float, float] = (1.03, 0.97)
    """Factors on a parameter's value from which its fit begins [-]."""
    parameter_prior: float = 0.5
    """Prior probability that a parameter is off, relative to that of an effect [-]."""
    settled_current: float = 0.02
    """Distance from the end value, relative to the greatest current, where a transient is over [-]."""
    flowing_rate: float = 1e6
    """Rate of p3 from which the control chamber fills or vents [Pa/s]."""
    unseated_stroke: float = 1e-3
    """Share of its stroke beyond which a mover is off its seat [-]."""
    moving_speed: float = 2e-3
    """Least speed of a piston that opens or shuts [m/s]."""
    separating_share: float = 0.5
    """An experiment separates rivals if it leaves at most this share of the doubt about the best [-]."""
    certain: float = 0.95
    """Probability of the best rival above which no further experiment is needed [-]."""
    region_probability: float = 0.95
    """Probability that the plant file's region holds the parameters [-]."""


VALVE = ValveSettings()
"""The settings of a diagnosis that is given none."""
