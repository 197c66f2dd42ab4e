"""A pygame surface with anti-aliased shapes and text, and the colours of the picture.

Everything is drawn at twice the size, then scaled down: this is what makes edges smooth.
"""

import os
import re
from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from math import hypot
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray

from epv_env.common.extras import how_to_install

if TYPE_CHECKING:
    import pygame

Colour = tuple[int, int, int]  # red, green and blue, 0 to 255
Point = tuple[float, float]  # place from the left and from above [px]
Box = tuple[float, float, float, float]  # left, top, right, bottom [px]

PAGE, CARD, EDGE, GRID = (238, 241, 245), (255, 255, 255), (214, 220, 228), (232, 236, 241)
INK, MUTED, OUTLINE = (29, 39, 54), (104, 116, 134), (62, 72, 88)  # text, secondary text, rims
BODY, HATCH, IRON, RUBBER = (203, 209, 218), (190, 197, 208), (136, 146, 160), (38, 42, 50)
STEEL, STEEL_SHADE = (232, 235, 240), (196, 203, 213)
COIL_COLD, COIL_HOT = (173, 128, 98), (255, 176, 32)  # winding without current, with full current
WIRE_COLD, WIRE_HOT = (206, 166, 138), (255, 230, 150)
P1, P2, P3 = (84, 96, 118), (20, 108, 214), (176, 58, 156)  # curves
COIL, CONSUMPTION, TARGET, BAND = (222, 140, 0), (0, 134, 139), (24, 138, 84), (214, 240, 224)
GOOD, BAD = TARGET, (205, 52, 52)  # a kept and a violated limit

SCALE_TOP_BAR = 14.0  # pressure at the dark end of the scale [bar absolute]; the light end is vacuum
_SCALE = (
    (255, 255, 225), (232, 246, 184), (190, 229, 181), (127, 205, 187), (65, 174, 200),
    (34, 134, 190), (36, 92, 168), (37, 56, 146), (14, 30, 92),
)  # fmt: skip

FACTOR = 2  # drawing pixels per frame pixel, in each direction


def blend(share: float, *colours: Colour) -> Colour:
    """The colour at `share` of the way, limited to [0, 1], along evenly spaced colours."""
    place = min(max(share, 0.0), 1.0) * (len(colours) - 1)
    step = min(int(place), len(colours) - 2)
    pairs = zip(colours[step], colours[step + 1], strict=True)
    red, green, blue = (round(x + (place - step) * (y - x)) for x, y in pairs)
    return red, green, blue


def pressure_colour(p_bar: float) -> Colour:
    """Colour of gas at a pressure [bar absolute]: pale when low, dark blue when high."""
    return blend(p_bar / SCALE_TOP_BAR, *_SCALE)


def load_pygame() -> ModuleType:
    """pygame, imported on first use. Raises DependencyNotInstalled."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        import pygame
    except ImportError as error:
        raise DependencyNotInstalled(
            f"pygame draws the valve and is not installed: {how_to_install('render')}"
        ) from error
    return pygame


class Canvas:
    """Draws in frame pixels on a surface FACTOR times as large."""

    def __init__(self, width: int, height: int):
        """width, height: size of the frame [px]."""
        self._pygame = load_pygame()
        self._pygame.font.init()
        self._size = (width, height)
        # The masks of rendered text, without alpha: with others it is drawn 20 times slower.
        masks = (0xFF0000, 0x00FF00, 0x0000FF, 0)
        self.surface = self._pygame.Surface((FACTOR * width, FACTOR * height), 0, 32, masks)
        self._font = cache(lambda height: self._pygame.font.Font(None, height))

    def frame(self) -> "pygame.Surface":
        """The frame, a surface of its size."""
        return self._pygame.transform.smoothscale(self.surface, self._size)

    def rectangle(self, box: Box, colour: Colour, *, radius: float = 0.0, outline: float = 0.0) -> None:
        """A filled rectangle, or with outline > 0 [px] its rim; radius of its corners [px]."""
        rim, corner = round(outline * FACTOR), round(radius * FACTOR)
        self._pygame.draw.rect(self.surface, colour, self.rect(box), rim, border_radius=corner)

    def plate(self, box: Box, radius: float) -> None:
        """A white plate with a fine rim, on which words or pictures stand."""
        self.rectangle(box, CARD, radius=radius)
        self.rectangle(box, EDGE, radius=radius, outline=1)

    def polygon(self, points: Sequence[Any], colour: Colour, rim: Colour | None = None) -> None:
        """A filled polygon, and its rim, 1.5 px wide, in a second colour."""
        corners = [(x * FACTOR, y * FACTOR) for x, y in points]
        self._pygame.draw.polygon(self.surface, colour, corners)
        if rim is not None:
            self._pygame.draw.polygon(self.surface, rim, corners, 3)

    def circle(self, centre: Point, radius: float, colour: Colour) -> None:
        """A disc; radius [px]."""
        x, y = centre
        self._pygame.draw.circle(self.surface, colour, (x * FACTOR, y * FACTOR), radius * FACTOR)

    def polyline(self, points: NDArray[np.float64], colour: Colour, width: float) -> None:
        """A thin line through points of shape (n, 2), for curves; width [px]."""
        if len(points) > 1:
            path = (points * FACTOR).tolist()
            self._pygame.draw.lines(self.surface, colour, False, path, round(width * FACTOR))

    def stroke(self, points: Sequence[Any], colour: Colour, width: float) -> None:
        """A line of the same width in every direction, with round joints and ends; width [px]."""
        for (x0, y0), (x1, y1) in pairwise(points):
            # pygame measures the width of a line along the nearer axis.
            across = hypot(x1 - x0, y1 - y0) / max(abs(x1 - x0), abs(y1 - y0), 1e-9)
            ends = (x0 * FACTOR, y0 * FACTOR), (x1 * FACTOR, y1 * FACTOR)
            self._pygame.draw.line(self.surface, colour, *ends, round(width * across * FACTOR))
        for x, y in points:
            self.circle((x, y), width / 2, colour)

    def arrow(self, points: Sequence[Point], colour: Colour, width: float, rim: Colour) -> None:
        """An arrow along the points, with its tip at the last; width of its shaft [px]."""
        tip = self._pygame.Vector2(points[-1])
        along = (tip - points[-2]).normalize()
        neck = tip - (2.2 * width + 2.0) * along
        half = (1.5 * width + 1.0) * along.rotate(90.0)
        shaft, head = [*points[:-1], neck], [tip, neck + half, neck - half]
        self.stroke(shaft, rim, width + 2.5)
        self.stroke([*head, tip], rim, 2.5)
        self.stroke(shaft, colour, width)
        self.polygon(head, colour)

    def text(self, text: str, at: Point, size: int, colour: Colour, align: float = 0.0) -> float:
        """Text centred in height on `at`; returns its width [px].

        align: 0 begins there, 0.5 is centred, 1 ends there. `_` puts the rest of a word lower and
        smaller: "p_2 [bar]".
        """
        pieces = []
        for place, piece in enumerate(re.split(r"_(\w+)", text)):
            shrunk, drop = (0.74, 0.24) if place % 2 else (1.0, 0.0)
            height = round(size * FACTOR * shrunk)
            pieces.append((self._font(height).render(piece, True, colour), drop * height))
        total = sum(surface.get_width() for surface, _ in pieces)
        x, y = at[0] * FACTOR - align * total, at[1] * FACTOR
        for surface, drop in pieces:
            self.surface.blit(surface, (round(x), round(y + drop - surface.get_height() / 2)))
            x += surface.get_width()
        return total / FACTOR

    def rect(self, box: Box) -> "pygame.Rect":
        """The box on the surface."""
        left, top, right, bottom = (round(edge * FACTOR) for edge in box)
        return self._pygame.Rect(left, top, right - left, bottom - top)
