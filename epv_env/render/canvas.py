"""A pygame surface with anti-aliased shapes and text, and its colours, one for each thing.

Everything is drawn at twice the size, then scaled down: this is what makes edges smooth.
"""

import os
from collections.abc import Sequence
from itertools import pairwise
from math import hypot
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray

from epv_env.common.extras import how_to_install

Colour = tuple[int, int, int]  # red, green and blue, 0 to 255

PAGE: Colour = (238, 241, 245)  # background of the window
CARD: Colour = (255, 255, 255)  # background of a panel
EDGE: Colour = (214, 220, 228)  # border of a panel
GRID: Colour = (232, 236, 241)  # grid lines
INK: Colour = (29, 39, 54)  # text
MUTED: Colour = (104, 116, 134)  # secondary text

BODY: Colour = (203, 209, 218)  # valve body
HATCH: Colour = (190, 197, 208)  # hatching of the valve body
OUTLINE: Colour = (62, 72, 88)  # outlines of parts
STEEL: Colour = (232, 235, 240)  # moving steel parts
STEEL_SHADE: Colour = (196, 203, 213)  # shaded side of moving steel parts
IRON: Colour = (136, 146, 160)  # iron of the magnet
RUBBER: Colour = (38, 42, 50)  # seals
COIL_COLD: Colour = (173, 128, 98)  # winding without current
COIL_HOT: Colour = (255, 176, 32)  # winding with full current
WIRE_COLD: Colour = (206, 166, 138)  # wires without current
WIRE_HOT: Colour = (255, 230, 150)  # wires with full current

P1: Colour = (84, 96, 118)  # curve of p1
P2: Colour = (20, 108, 214)  # curve of p2
P3: Colour = (176, 58, 156)  # curve of p3
TARGET: Colour = (24, 138, 84)  # line of the target
BAND: Colour = (214, 240, 224)  # band around the target
COIL: Colour = (222, 140, 0)  # curve of the coil's command
CONSUMPTION: Colour = (0, 134, 139)  # curve of the consumption
GOOD: Colour = (24, 138, 84)  # A kept limit
BAD: Colour = (205, 52, 52)  # A violated limit

SCALE_TOP_BAR = 14.0  # pressure at the dark end of the scale [bar absolute]; the light end is vacuum

_ANCHORS: tuple[Colour, ...] = (
    (255, 255, 225), (232, 246, 184), (190, 229, 181), (127, 205, 187), (65, 174, 200),
    (34, 134, 190), (36, 92, 168), (37, 56, 146), (14, 30, 92),
)  # fmt: skip


def mix(a: Colour, b: Colour, share: float) -> Colour:
    """The colour `share` of the way from a to b; share is limited to [0, 1]."""
    share = min(max(share, 0.0), 1.0)
    red, green, blue = (round(x + share * (y - x)) for x, y in zip(a, b, strict=True))
    return red, green, blue


def pressure_colour(p_bar: float) -> Colour:
    """Colour of gas at a pressure [bar absolute]: pale when low, dark blue when high."""
    place = min(max(p_bar / SCALE_TOP_BAR, 0.0), 1.0) * (len(_ANCHORS) - 1)
    step = min(int(place), len(_ANCHORS) - 2)
    return mix(_ANCHORS[step], _ANCHORS[step + 1], place - step)


if TYPE_CHECKING:
    import pygame

Point = tuple[float, float]  # place from the left and from above [px]
Box = tuple[float, float, float, float]  # left, top, right, bottom [px]

FACTOR = 2  # drawing pixels per frame pixel, in each direction


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
    """Draws in frame pixels on a surface FACTOR times as large; `frame` gives the frame."""

    def __init__(self, width: int, height: int):
        """width, height: size of the frame [px]."""
        self._pygame = load_pygame()
        self._pygame.font.init()
        # The masks of rendered text, without alpha: with others it is drawn 20 times slower.
        masks = (0xFF0000, 0x00FF00, 0x0000FF, 0)
        self._drawing = self._pygame.Surface((FACTOR * width, FACTOR * height), 0, 32, masks)
        self._background = self._drawing.copy()
        self._fonts: dict[int, pygame.font.Font] = {}

    def keep_as_background(self) -> None:
        """What is drawn now is what `clear` returns to."""
        self._background.blit(self._drawing, (0, 0))

    def clear(self) -> None:
        """Draw the background over everything."""
        self._drawing.blit(self._background, (0, 0))

    def clip(self, box: Box | None) -> None:
        """Draw only within the box; None: everywhere."""
        self._drawing.set_clip(None if box is None else self._rect(box))

    def frame(self) -> "pygame.Surface":
        """The frame, a surface of its size."""
        width, height = self._drawing.get_size()
        size = (width // FACTOR, height // FACTOR)
        return self._pygame.transform.smoothscale(self._drawing, size)

    def rectangle(self, box: Box, colour: Colour, *, radius: float = 0.0, outline: float = 0.0) -> None:
        """A filled rectangle, or with outline > 0 [px] its rim; radius of its corners [px]."""
        rim, corner = round(outline * FACTOR), round(radius * FACTOR)
        self._pygame.draw.rect(self._drawing, colour, self._rect(box), rim, border_radius=corner)

    def polygon(self, points: Sequence[Point], colour: Colour, rim: Colour | None = None) -> None:
        """A filled polygon, and its rim, 1.5 px wide, in a second colour."""
        corners = [(x * FACTOR, y * FACTOR) for x, y in points]
        self._pygame.draw.polygon(self._drawing, colour, corners)
        if rim is not None:
            self._pygame.draw.polygon(self._drawing, rim, corners, 3)

    def circle(self, centre: Point, radius: float, colour: Colour) -> None:
        """A disc; radius [px]."""
        x, y = centre
        self._pygame.draw.circle(self._drawing, colour, (x * FACTOR, y * FACTOR), radius * FACTOR)

    def polyline(self, points: NDArray[np.float64], colour: Colour, width: float) -> None:
        """A thin line through points of shape (n, 2), for curves; width [px]."""
        if len(points) > 1:
            path = (points * FACTOR).tolist()
            self._pygame.draw.lines(self._drawing, colour, False, path, round(width * FACTOR))

    def stroke(self, points: Sequence[Point], colour: Colour, width: float) -> None:
        """A line of the same width in every direction, with round joints and ends; width [px]."""
        half = width / 2
        for (x0, y0), (x1, y1) in pairwise(points):
            length = max(hypot(x1 - x0, y1 - y0), 1e-9)
            dx, dy = half * (y1 - y0) / length, half * (x0 - x1) / length
            sides = [(x0 + dx, y0 + dy), (x1 + dx, y1 + dy), (x1 - dx, y1 - dy), (x0 - dx, y0 - dy)]
            self.polygon(sides, colour)
        for point in points:
            self.circle(point, half, colour)

    def arrow(
        self, points: Sequence[Point], colour: Colour, width: float, rim: Colour | None = None
    ) -> None:
        """An arrow along the points, with its tip at the last; width of its shaft [px]."""
        (x0, y0), (x1, y1) = points[-2:]
        length = max(hypot(x1 - x0, y1 - y0), 1e-9)
        ux, uy = (x1 - x0) / length, (y1 - y0) / length
        wide, long = 1.5 * width + 1.0, 2.2 * width + 2.0
        neck = (x1 - long * ux, y1 - long * uy)
        head = [
            (x1, y1),
            (neck[0] - wide * uy, neck[1] + wide * ux),
            (neck[0] + wide * uy, neck[1] - wide * ux),
        ]
        shaft = [*points[:-1], neck]
        if rim is not None:
            self.stroke(shaft, rim, width + 2.5)
            self.stroke([*head, head[0]], rim, 2.5)
        self.stroke(shaft, colour, width)
        self.polygon(head, colour)

    def text(self, text: str, at: Point, size: int, colour: Colour, *, align: float = 0.0) -> float:
        """Text centred in height on `at`; returns its width [px].

        align: 0 begins there, 0.5 is centred, 1 ends there. `_` puts the rest of a word lower and
        smaller: "p_2 [bar]".
        """
        pieces = []
        for piece, lowered in _pieces(text):
            height = round(size * FACTOR * (0.74 if lowered else 1.0))
            if height not in self._fonts:
                self._fonts[height] = self._pygame.font.Font(None, height)
            surface = self._fonts[height].render(piece, True, colour)
            pieces.append((surface, 0.24 * height if lowered else 0.0))
        total = sum(surface.get_width() for surface, _ in pieces)
        x, y = at[0] * FACTOR - align * total, at[1] * FACTOR
        for surface, drop in pieces:
            self._drawing.blit(surface, (round(x), round(y + drop - surface.get_height() / 2)))
            x += surface.get_width()
        return total / FACTOR

    @staticmethod
    def _rect(box: Box) -> tuple[int, int, int, int]:
        left, top, right, bottom = (round(edge * FACTOR) for edge in box)
        return left, top, right - left, bottom - top


def _pieces(text: str) -> list[tuple[str, bool]]:
    """Text cut into pieces, and whether each is lowered: "p_2 x" gives p, 2 (lowered), " x"."""
    first, *others = text.split("_")
    pieces = [(first, False)]
    for other in others:
        low, space, rest = other.partition(" ")
        pieces += [(low, True), (space + rest, False)]
    return [(piece, lowered) for piece, lowered in pieces if piece]
