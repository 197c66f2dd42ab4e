"""Settings of the integration of plain differential equations."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class OdeSettings:
    """Accuracy of the integrator."""

    step_error: float = 0.05
    """Largest change of a reading by halving the sub-steps [noise deviations]: far below what the
    readings can show."""

    most_steps_per_sample: int = 256
    """Most sub-steps in a sampling period that are tried; a model that needs more is stiff, and an
    explicit method is the wrong one for it."""

    approach_factor: float = 8.0
    """By what a sub-step is divided when it would pass a threshold; computing time only."""

    shortest_step: float = 1e-8
    """Sub-step at which a threshold is passed, relative to the ordinary sub-step [1]: a threshold is
    located to this accuracy, well above rounding."""

    most_event_steps: int = 600
    """Most steps within one sub-step near thresholds; ten crossings in one sub-step fit in."""
