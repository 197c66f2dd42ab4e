"""What the FMU of the plant starts from, and how finely it integrates."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class FmuSettings:
    """Constants of judgement of the plant's FMU; the other constants are those of the kernel."""

    longest_step: float = 250e-6
    """Start of the parameter longest_step [s]: the integration step while a mover moves, the kernel's;
    twice as long while both movers are held."""
    shortest_longest_step: float = 1e-6
    """Least value of that parameter [s]: finer than any effect asks for."""
    most_steps_per_second: int = 2_000_000
    """Steps in each second begun of a communication step after which the FMU gives up: twice as many as
    the finest longest_step needs, so that only rebounds without end are given up."""
    p1: float = 9.5e5
    """Start of p1 [Pa absolute]: a reservoir that the compressor has just filled."""
    p2: float = 8e5
    """Start of p2 [Pa absolute]: the circuit at the target of the environment's episodes."""
    U: float = 24.0
    """Voltage before an importer gives one [V]: the coil is on, the valve shut and at rest."""
    communication_step: float = 1e-3
    """Communication step that modelDescription.xml proposes [s]: a fifth of the control period, so that
    a policy beside the plant loses little time."""


SETTINGS = FmuSettings()
