"""Colours: one for each thing, and the scale that turns a pressure into one."""

from itertools import pairwise

Colour = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

PAGE: Colour = (238, 241, 245)
"""Background of the window."""
CARD: Colour = (255, 255, 255)
"""Background of a panel."""
EDGE: Colour = (214, 220, 228)
"""Border of a panel."""
GRID: Colour = (232, 236, 241)
"""Grid lines."""
INK: Colour = (29, 39, 54)
"""Text."""
MUTED: Colour = (104, 116, 134)
"""Secondary text."""

BODY: Colour = (203, 209, 218)
"""Valve body."""
HATCH: Colour = (190, 197, 208)
"""Hatching of the valve body."""
OUTLINE: Colour = (62, 72, 88)
"""Outlines of parts."""
STEEL: Colour = (232, 235, 240)
"""Moving steel parts."""
STEEL_SHADE: Colour = (196, 203, 213)
"""Shaded side of moving steel parts."""
IRON: Colour = (136, 146, 160)
"""Iron of the magnet."""
RUBBER: Colour = (38, 42, 50)
"""Seals."""
COIL_COLD: Colour = (173, 128, 98)
"""Winding without current."""
COIL_HOT: Colour = (255, 176, 32)
"""Winding with full current."""
WIRE_COLD: Colour = (206, 166, 138)
"""Wires without current."""
WIRE_HOT: Colour = (255, 230, 150)
"""Wires with full current."""

P1: Colour = (84, 96, 118)
"""Curve of p1."""
P2: Colour = (20, 108, 214)
"""Curve of p2."""
P3: Colour = (176, 58, 156)
"""Curve of p3."""
TARGET: Colour = (24, 138, 84)
"""Line of the target."""
BAND: Colour = (214, 240, 224)
"""Band around the target."""
COIL: Colour = (222, 140, 0)
"""Curve of the coil's command."""
CONSUMPTION: Colour = (0, 134, 139)
"""Curve of the consumption."""
GOOD: Colour = (24, 138, 84)
"""A kept limit."""
BAD: Colour = (205, 52, 52)
"""A violated limit."""

SCALE_TOP_BAR = 14.0
"""Pressure at the dark end of the scale [bar absolute]; the light end is vacuum."""

_ANCHORS: tuple[Colour, ...] = (
    (255, 255, 225),
    (232, 246, 184),
    (190, 229, 181),
    (127, 205, 187),
    (65, 174, 200),
    (34, 134, 190),
    (36, 92, 168),
    (37, 56, 146),
    (14, 30, 92),
)


def mix(a: Colour, b: Colour, share: float) -> Colour:
    """The colour `share` of the way from a to b; share is limited to [0, 1]."""
    share = min(max(share, 0.0), 1.0)
    red, green, blue = (round(x + share * (y - x)) for x, y in zip(a, b, strict=True))
    return red, green, blue


_STEPS = tuple(pairwise(_ANCHORS))


def pressure_colour(p_bar: float) -> Colour:
    """Colour of gas at a pressure [bar absolute]: pale when low, dark blue when high."""
    place = min(max(p_bar / SCALE_TOP_BAR, 0.0), 1.0) * len(_STEPS)
    step = min(int(place), len(_STEPS) - 1)
    return mix(*_STEPS[step], place - step)
