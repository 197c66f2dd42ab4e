"""What one frame shows, and where the parts of the section are [px of the frame].

Not to scale: both strokes are enlarged.
"""

from dataclasses import dataclass
from typing import NamedTuple

from epv_env.render.canvas import Box


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


BLOCK: Box = (96, 162, 590, 622)  # the valve's body

# Magnet valve, upper left: from above the exhaust bore, the core, the armature, the inlet nozzle.
MV = 190.0  # axis of the magnet valve
TUBE = 27.0  # half width of the tube in which the armature moves
ARMATURE = 22.0  # half width of the armature
NOSE = 11.0  # half width of the armature's nose, which shuts the exhaust
NOSE_LENGTH = 26.0  # length of the nose
ARMATURE_LENGTH = 94.0  # length of the armature, its nose included
BORE = 5.5  # half width of the exhaust bore and of the riser to the inlet
CORE_TIP = 236.0  # height of the exhaust seat
INLET_TIP = 354.0  # height of the inlet seat
MV_CHAMBER: Box = (130, 320, 250, 386)  # chamber around the inlet nozzle
COIL_TOP, COIL_BOTTOM = 182.0, 308.0
STROKE_MV = INLET_TIP - CORE_TIP - ARMATURE_LENGTH  # drawn stroke of the armature

# Protection valve, right: from above the control chamber, the piston, the seat, the output chamber.
PV = 438.0  # axis of the protection valve
PISTON = 90.0  # half width of the piston
PISTON_LENGTH = 60.0  # height of the piston
BOSS_LENGTH = 18.0  # boss on the piston's back, which meets the stop
CEILING = 184.0  # top of the control chamber
SEAT = 396.0  # height of the seat
SEAT_INNER, LIP, SEAT_OUTER = 50.0, 56.0, 64.0
"""Half widths of the seat's bore, of its lip and of its foot."""
FLOOR = 470.0  # bottom of the ring chamber around the seat
STROKE_PV = 48.0  # drawn stroke of the piston

INPUT: Box = (96, 424, 314, 600)  # input chamber
NECK: Box = (313, 424, PV - PISTON, FLOOR)  # passage from the input chamber to the ring around the seat
OUTPUT: Box = (PV - 74, 508, 590, 602)  # output chamber
DUCT: tuple[Box, ...] = ((249, 360, 306, 374), (292, 196, 306, 374), (292, 196, 349, 210))
"""From the magnet valve's chamber to the control chamber."""


class Movers(NamedTuple):
    """Heights of the moving parts."""

    armature_top: float
    """Upper end of the armature [px]."""
    armature_bottom: float
    """Lower end of the armature [px]."""
    piston_top: float
    """Back of the piston [px]."""
    piston_bottom: float
    """Sealing face of the piston [px]."""


def movers(snapshot: Snapshot) -> Movers:
    """Where the armature and the piston are."""
    lift_MV = STROKE_MV * min(max(snapshot.xMV_fraction, 0.0), 1.0)
    lift_PV = STROKE_PV * min(max(snapshot.xPV_fraction, 0.0), 1.0)
    return Movers(
        armature_top=INLET_TIP - lift_MV - ARMATURE_LENGTH,
        armature_bottom=INLET_TIP - lift_MV,
        piston_top=SEAT - lift_PV - PISTON_LENGTH,
        piston_bottom=SEAT - lift_PV,
    )
