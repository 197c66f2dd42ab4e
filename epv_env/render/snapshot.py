"""What one frame shows: the door from SI units and batches to the picture."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """One valve at one instant, in the units of the picture. Pressures are absolute."""

    time_s: float
    """Time since the episode began [s]."""
    p1_bar: float
    """Input chamber (reservoirs) [bar]."""
    p2_bar: float
    """Output chamber (brake circuit) [bar]."""
    p3_bar: float
    """Control chamber [bar]."""
    target_bar: float
    """Pressure to which p2 is to be limited [bar]."""
    xPV_fraction: float
    """Stroke of the protection valve's piston over its maximum, 0 shut .. 1 open [-]."""
    xMV_fraction: float
    """Stroke of the magnet valve's armature over its maximum, 0 released .. 1 pulled in [-]."""
    I_A: float
    """Coil current [A]."""
    coil_on: bool
    """Coil command during the step that ended at time_s."""
    sigma_S_g_per_s: float
    """Air consumed from the circuit during that step [g/s]."""
