"""What one frame shows, and the table of all places in the section [px of the frame].

Not to scale: both strokes are enlarged. Parts stand where they are at rest: the protection valve
shut, the armature released.
"""

from typing import NamedTuple

from epv_env.render import canvas as c
from epv_env.render.canvas import Box, Colour, Point


class Snapshot(NamedTuple):
    """One valve at one instant, in the units of the picture. Pressures are absolute."""

    time_s: float  # time since the episode began [s]
    p1_bar: float  # input chamber (reservoirs) [bar]
    p2_bar: float  # output chamber (brake circuit) [bar]
    p3_bar: float  # control chamber [bar]
    target_bar: float  # pressure to which p2 is to be limited [bar]
    xPV_fraction: float  # stroke of the protection valve's piston over its maximum, 0 shut .. 1 open [-]
    xMV_fraction: float  # stroke of the armature over its maximum, 0 released .. 1 pulled in [-]
    I_A: float  # coil current [A]
    coil_on: bool  # coil command during the step that ended at time_s
    sigma_S_g_per_s: float  # air consumed from the circuit during that step [g/s]


class Gas(NamedTuple):
    """A box of gas, of which an edge may move with the armature or the piston."""

    pressure: str  # field of Snapshot, or "ambient"
    box: Box
    top: str = ""  # what moves the upper edge
    bottom: str = ""  # what moves the lower edge


class Part(NamedTuple):
    """A solid that turns around an axis, cut along it."""

    axis: float  # place from the left
    profile: tuple[Point, ...]  # half widths and heights along its outline
    colour: Colour
    mover: str = ""
    hollow: bool = False  # cut in two halves, left and right of a bore
    rim: Colour | None = c.OUTLINE


MV, PV = 190.0, 438.0  # axes of the magnet valve and of the protection valve
STROKE = {"": 0.0, "armature": 24.0, "piston": 48.0}  # by which parts rise when fully moved
BLOCK: Box = (96, 162, 590, 622)  # the valve's body
PORTS = ((94, 422, 96, 602), (590, 506, 592, 604), (182.5, 160, 197.5, 162))  # openings of the body
SEAT = 396.0  # height of the protection valve's seat
LIP = (68.0, 38.0)  # half widths between which the pressure falls over the open seat
GAS = (  # later boxes lie on earlier ones
    Gas("p1_bar", (96, 424, 314, 600)),  # input chamber
    Gas("p1_bar", (313, 424, 348, 470)),  # neck from it to the ring around the seat
    Gas("p1_bar", (348, SEAT, 528, 470), top="piston"),  # ring around the seat
    Gas("p2_bar", (364, 508, 590, 602)),  # output chamber
    Gas("p2_bar", (388, SEAT, 488, 509), top="piston"),  # bore of the seat
    Gas("p3_bar", (130, 320, 250, 386)),  # chamber around the inlet nozzle
    Gas("p3_bar", (163, 228, 217, 321)),  # tube of the armature
    Gas("p3_bar", (249, 360, 306, 374)),  # duct to the control chamber
    Gas("p3_bar", (292, 196, 306, 374)),
    Gas("p3_bar", (292, 196, 349, 210)),
    Gas("p3_bar", (348, 184, 528, 336), bottom="piston"),  # control chamber
    Gas("p1_bar", (184.5, 354, 195.5, 425)),  # riser to the inlet
    Gas("ambient", (184.5, 162, 195.5, 236)),  # bore of the exhaust
)
WINDINGS = ((111.0, 182.0, 155.0, 308.0), (225.0, 182.0, 269.0, 308.0))
WIRES = tuple((10.0 + 12.0 * k, 9.0 + 15.4 * row) for row in range(8) for k in range(3))
WIRE, BRIGHT_A = 4.6, 0.45  # radius of a wire; current at which the winding is brightest [A]
SPRINGS = (  # axis, half width, top, bottom, what moves it, coils, width of the wire
    (MV, 19.0, 228.0, 286.0, "armature", 4, 3.0),
    (PV, 46.0, 184.0, 336.0, "piston", 5, 5.0),
)
_CORE = ((5.5, 172), (27, 172), (27, 227), (12, 227), (8.5, 236), (5.5, 236))
PARTS = (
    Part(MV, ((5.5, 226), (5.5, 236)), c.pressure_colour(1.0), rim=None),  # bore, in front of the spring
    Part(MV, _CORE, c.IRON, hollow=True),
    Part(MV, ((5.5, 387), (26, 387), (9.5, 354), (5.5, 354)), c.IRON, hollow=True),  # inlet nozzle
    Part(MV, ((11, 260), (11, 286), (22, 286), (22, 354)), c.STEEL, "armature"),
    Part(MV - 15.5, ((2.5, 290), (2.5, 350)), c.CARD, "armature", rim=None),  # its gloss
    Part(MV, ((9, 260), (9, 265)), c.RUBBER, "armature", rim=None),  # seal of the exhaust
    Part(MV, ((13, 348), (13, 354)), c.RUBBER, "armature", rim=None),  # seal of the inlet
    Part(PV, ((16, 183), (16, 270)), c.BODY),  # stop of the piston
    Part(PV, ((50, 471), (64, 471), (64, 418), (56, SEAT), (50, SEAT)), c.BODY, hollow=True),  # seat
    Part(PV, ((16, 318), (16, 337)), c.STEEL_SHADE, "piston"),  # boss, which meets the stop
    Part(PV, ((90, 336), (90, SEAT)), c.STEEL, "piston"),
    Part(PV, ((89, 378), (89, 395)), c.STEEL_SHADE, "piston", rim=None),
    Part(PV, ((64, 388), (64, SEAT)), c.RUBBER, "piston", rim=None),  # seal of the piston
    *(
        Part(PV + x, ((2, 357), (5, 360), (5, 364), (2, 367)), c.RUBBER, "piston", rim=None)
        for x in (-86.0, 86.0)  # O-ring
    ),
)
OVER_SEAT = (30.0, 77.0, 402.0, 474.0, 458.0)
"""Arrow over the seat: half widths of its ends, height of its bend, of its tip and of its tail."""
FLOWS = (  # what flows, its path, width of the arrow [px], field of the pressure that colours it
    ("inlet", ((MV, 446.0), (MV, 364.0)), 4.0, None),
    ("duct", ((299.0, 352.0), (299.0, 226.0)), 4.0, None),
    ("exhaust", ((MV, 159.0), (MV, 112.0)), 7.0, "p3_bar"),
    ("entering", ((32.0, 512.0), (90.0, 512.0)), 9.0, "p1_bar"),
    ("consumption", ((597.0, 556.0), (652.0, 556.0)), 7.0, "p2_bar"),
)
GAUGES = (  # place of its zero, what it shows, side of its words, names of its ends
    ((606.0, SEAT), "piston", 1.0, ("shut", "open")),
    ((82.0, 354.0), "armature", -1.0, ("out", "in")),
)
SCALE: Box = (150, 660, 536, 672)  # scale of colours
CHIPS = (  # a chamber's name, its pressure, centre of the plate, colour of its curve
    ("Input chamber", "p_1 {p1_bar:.2f} bar", (205.0, 538.0), c.P1),
    ("Output chamber", "p_2 {p2_bar:.2f} bar", (500.0, 559.0), c.P2),
    ("Control chamber", "p_3 {p3_bar:.2f} bar", (PV, 131.0), c.P3),
)
POINTER: Box = (PV - 1, 150, PV + 1, 188)  # from the plate of p3 to its chamber
NAMES = (  # words that stay: text, place, size, colour, alignment
    ("Magnet valve (MV)", (MV, 91.0), 19, c.INK, 0.5),
    ("Protection valve (PV)", (PV, 91.0), 19, c.INK, 0.5),
    ("from", (60.0, 474.0), 16, c.MUTED, 0.5),
    ("reservoirs", (59.0, 490.0), 16, c.MUTED, 0.5),
    ("to brake", (625.0, 516.0), 16, c.MUTED, 0.5),
    ("circuit", (625.0, 532.0), 16, c.MUTED, 0.5),
    ("coil", (59.0, 210.0), 18, c.INK, 0.5),
    ("pressure", (138.0, 660.0), 16, c.INK, 1.0),
    ("bar absolute", (138.0, 675.0), 16, c.MUTED, 1.0),
    ("not to scale,", (550.0, 660.0), 16, c.MUTED, 0.0),
    ("strokes enlarged", (550.0, 675.0), 16, c.MUTED, 0.0),
)
VALUES = (  # words of the snapshot
    ("{sigma_S_g_per_s:.2f} g/s", (625.0, 582.0), 16, c.INK, 0.5),
    ("{I_A:.2f} A", (59.0, 254.0), 18, c.INK, 0.5),
    ("x_PV {xPV:.0f} %", (602.0, 320.0), 18, c.INK, 0.0),
    ("x_MV {xMV:.0f} %", (90.0, 302.0), 18, c.INK, 1.0),
)
STATES = (  # what is told, its words, place, size, colour while it is so, alignment
    ("coil", ("OFF", "ON"), (59.0, 232.0), 24, c.COIL, 0.5),
    ("exhaust", ("exhaust shut", "exhaust open"), (208.0, 133.0), 17, c.INK, 0.0),
    ("inlet", ("inlet shut", "inlet open"), (106.0, 404.0), 17, c.INK, 0.0),
)
