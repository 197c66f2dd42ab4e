"""Settings of the fault localisation."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class LocalisationSettings:
    """Judgement in where the gap lies: windows, forcings, faults of the readings, regimes."""

    # Windows and runs

    windows: int = 80
    """Most windows of a run in which a forcing is constant; computing time."""

    uniform_share: float = 0.3
    """Share of the windows spread uniformly in time [1]; the others follow the states' motion."""

    samples: int = 8000
    """Most samples of the runs that are examined together, for time and memory; one run at least."""

    # Faults of the readings

    lags: tuple[int, ...] = (1, 3, 10, 30)
    """Time constants of first-order lags [samples]; their sums come near a lag of any time constant."""

    delays: tuple[int, ...] = (1, 2, 4, 8, 16)
    """Delays [samples]; their sums come near any delay."""

    # Gaussian processes of the forcing

    amplitude_decades: tuple[float, float] = (-3.0, 9.0)
    """Decimal logarithms of the smallest and the largest variance of a forcing, relative to what the
    readings tell of it on average [1]: from no effect to far beyond any gap."""

    amplitudes: int = 37
    """Number of these variances, three per decade, over which the evidence is averaged."""

    state_length: float = 0.2
    """Correlation length of a function of a state, relative to the state's range [1]: a fifth, as the
    smooth terms of physics bend once or twice."""

    time_memory: float = 0.02
    """Correlation time of a slow forcing, relative to the longest run [1]: one or two windows."""

    rough_variance: float = 1e-3
    """Variance by which single windows may depart from a smooth forcing, relative to the whole [1]."""

    identifiable_share: float = 1e-7
    """Precision of a direction of forcings, relative to the most precise one [1], below which the
    direction is left out: rounding is no information."""

    rival_share: float = 0.5
    """Share of what the best equation explains [1], below which functions of states are not tried."""

    regularisation: float = 1e-9
    """Precision added to parameters that no reading determines [1], against a singular matrix."""

    # Probabilities

    prior_nothing: float = 0.9
    """Probability before any data that nothing is missing: only clear evidence names an equation."""

    prior_reading: float = 0.3
    """Probability before any data of a fault of the readings, relative to that of an equation [1]:
    sensors are checked more often than physics."""

    evidence_doubt: float = 0.5
    """Log evidences are divided by this number times the root of the largest one [1], since the assumed
    forms of a forcing are not exact."""

    # Regimes

    regime_block: float = 0.02
    """Longest part of a regime that the bootstrap draws as one [s]: longer than residuals correlate."""

    fewest_parts: int = 5
    """Fewest parts of a regime. With fewer on held-out runs all runs count; with fewer on all runs the
    gap has no interval."""
