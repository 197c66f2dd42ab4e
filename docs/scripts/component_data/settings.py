"""Settings of the analysis of measured component data."""

from dataclasses import dataclass

from epv_env.common.units import BAR


@dataclass(frozen=True, kw_only=True)
class ComponentSettings:
    """Judgements of the analysis, by component."""

    fewest_rows: int = 100
    """Least number of rows of a file [-]; every record is longer."""

    # Friction of seals.
    reversal_prominence: float = 0.02
    """Least prominence of a reversal of the position [m], for strokes of about 40 mm."""
    reversal_spacing: int = 100
    """Least distance between two reversals in one direction [samples]."""
    sliding_range: tuple[float, float] = (0.008, 0.028)
    """Positions between which a seal slides steadily [m]."""
    start_travel: float = 0.0006
    """Position at which the first stroke has begun [m]."""
    rest_position: float = 5e-4
    """Largest first position of a record that begins at rest [m]."""
    rest_samples: int = 8
    """Least samples of a record before the first stroke [-]. Some records lack the first 0.3 s: without
    the rise from rest they show no break-away."""
    reversal_travel: tuple[float, float] = (0.0005, 0.005)
    """Travel after a reversal between which an excess of friction is sought [m]."""
    reversal_points: int = 46
    """Points of this travel [-]."""
    resamples: int = 1000
    """Bootstrap samples of a mean [-]."""
    bootstrap_seed: int = 1
    """Of the bootstrap."""

    # Leaks of chambers.
    release_drop: float = 0.03 * BAR
    """Fall of the pressure that shows that the supply is shut [Pa]."""
    filled_samples: int = 20
    """Samples at the start of a record whose mean is the filled pressure [-]."""
    early_span: tuple[float, float] = (0.0, 15.0)
    """Span of the early rate of decay of a tight chamber [s]."""
    late_span: tuple[float, float] = (75.0, 150.0)
    """Span of the late rate of decay [s]."""
    settling_times: tuple[float, float] = (1.0, 60.0)
    """Least and largest time constant of settling [s]. Beyond 60 s a record of 145 s cannot separate
    settling from leaking."""
    settling_points: int = 80
    """Time constants that are tried [-]."""
    settled_share: float = 0.9
    """Share of the largest time constant from which it counts as undetermined [-]: it is then the bend
    of a slow creep, not a settling."""

    # Solenoids.
    on_time: float = 9.0
    """Time on of the 10 ms period at which currents are compared [ms]."""
    fewest_temperatures: int = 3
    """Least number of case temperatures of a slope [-]."""


DEFAULTS = ComponentSettings()
"""The settings of docs/results/component-data.md."""
