"""What the sensitivity study steps, samples and judges by (section 5)."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class SensitivitySettings:
    """Judgements of the sensitivity stage."""

    trajectories: int = 40
    """Of Morris's design: 1000 valves."""
    samples: int = 256
    """Of Sobol's design, a power of two: 6656 valves."""
    seed: int = 1
    """Of Morris's and Sobol's designs where the caller gives none."""
    grid_levels: int = 4
    """Levels of Morris's grid."""
    resamples: int = 1000
    """Draws of the bootstrap intervals of the global indices."""
    span: float = 0.5
    """Part of the change of Tables 8 and 9 over which the parameters vary together."""
    batch: int = 512
    """Valves simulated together; the record of 512 takes 100 MB."""
    difference_step: float = 2e-3
    """Step of the central differences: in the logarithm of a value; in half widths of the domain where
    the value is zero."""
    stated_change: float = 0.1
    """Change for which effects are stated, in the measure of `difference_step`: that of Table 8."""
    critical_index: float = 10.0
    """Collinearity index from which parameters are poorly identifiable (Brun et al.: 10 to 15)."""
    zero_eigenvalue: float = 1e-12
    """A least eigenvalue below this is zero within the accuracy of the differences."""
    scatter_range: tuple[float, float] = (18.5, 19.3)
    """Voltages between which the scatter of the fixed step is shown [V]."""
    scatter_points: int = 17
    """Voltages in that range."""
    relative_agreement: float = 0.1
    """A figure is reproduced if it differs from the printed one by at most this fraction of it ..."""
    absolute_agreement: float = 0.1
    """... or by at most this many percentage points."""
    required_figures: int = 36
    """Figures of Tables 8 and 9 that must come back."""


SENSITIVITY = SensitivitySettings()
"""The default settings."""
