"""What an export judges by: how many states it visits, and which rounding it allows."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ExportSettings:
    """Sizes and tolerances of an export."""

    episodes: int = 20
    """Episodes whose states calibrate the integers, and as many others that the code is compared on."""
    periods: int = 500
    """Control periods of each of them: 2.5 s; 10,000 states altogether."""
    input_headroom: float = 2.0
    """How much farther than on the visited states an entry of the observation may go [1]: the integers
    saturate beyond."""
    observation_tolerance: float = 2e-5
    """How far the C code's observation may lie from Python's [1], which is made of readings in double
    precision: single precision's 5e-7 bar at 8 bar, over the least scale, 0.1 bar, and rounded several
    times."""
    margin_factor: float = 8.0
    """How many times the rounding of the logits measured here is allowed elsewhere [1]: another compiler
    may contract or reorder sums, so that it rounds otherwise, but not much worse."""
    least_rounding: float = 1e-6
    """Rounding of the logits that is allowed at least, before the factor [1]."""


SETTINGS = ExportSettings()
