"""Settings of the fault localisation."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class LocalisationSettings:
    """Judgement in where the gap lies: windows, forcings, faults of the readings, regimes."""

    # Windows and runs

    windows: int = 80
    """Windows of a run in which a forcing is constant, where they follow its motion; computing time."""

    longest_window: float = 1.5
    """Length of a window, half of the motion lying in shorter ones, up to which windows follow the
    motion [time scales]: a third of a period at most."""

    resolved_window: float = 0.5
    """The same length where more windows are needed [time scales]: ten in a period."""

    most_windows: int = 400
    """Most windows of a run; where they are too few, only the first part of the run counts."""

    windows_together: int = 1200
    """Most windows of all runs where they are more than usual: time for matrices of this size."""

    most_values: int = 8_000_000
    """Most changes of a run's readings by its windows: 64 MB, of which three copies exist at a time."""

    uniform_share: float = 0.3
    """Share of the windows spread uniformly in time [1]; the others follow the states' motion."""

    samples: int = 8000
    """Most samples of the runs that are examined together, for time and memory; one run at least."""

    late_readings: float = 0.1
    """Share of a run before its first reading that counts [1], beyond which the run is examined only
    where there is no other."""

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

    regime_block: float = 4.0
    """Longest part of a regime that the bootstrap draws as one [time scales]: longer than residuals
    correlate."""

    regime_block_share: float = 0.05
    """The same relative to the shortest run [1], where that is less: enough parts in slow plants."""

    fewest_parts: int = 5
    """Fewest parts of a regime. With fewer on held-out runs all runs count; with fewer on all runs the
    gap has no interval."""
