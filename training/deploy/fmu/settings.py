"""What the FMU of the plant starts from, and how finely it integrates."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class FmuSettings:
    """Constants of judgement of the plant's FMU; the other constants are those of the kernel."""

    longest_step: float = 125e-6
    """Integration step while a mover moves [s], twice as long while both movers are held: half the
    kernel's, so that the FMU's own error is a sixteenth of the kernel's."""
    most_steps_per_second: int = 1_000_000
    """Steps in each second begun of a communication step after which the FMU gives up: 125 times as many
    as the longest step needs, so that only rebounds without end are given up."""
    p1: float = 9.5e5
    """Start of p1 [Pa absolute]: a reservoir that the compressor has just filled."""
    p2: float = 8e5
    """Start of p2 [Pa absolute]: the circuit at the target of the environment's episodes."""
    U: float = 24.0
    """Voltage before an importer gives one [V]: the coil is on, so that the valve is shut and at rest."""
    communication_step: float = 1e-3
    """Communication step that modelDescription.xml proposes [s]: a fifth of the control period, so that a
    policy beside the plant loses little time."""


SETTINGS = FmuSettings()
