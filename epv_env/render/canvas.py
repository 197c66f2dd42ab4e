"""A pygame surface with anti-aliased shapes and text, and its colours, one for each thing.

Everything is drawn at twice the size, then averaged: this is what makes edges smooth.
"""

import os
from collections.abc import Sequence
from itertools import pairwise
from math import hypot
from types import ModuleType
from typing import TYPE_CHECKING

import numba
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


@numba.njit(cache=True)
def halved(drawing: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Mean of every 2 x 2 pixels, from pygame's memory to an image.

    drawing: (2 h, 2 w, 4), bytes blue, green, red, unused. Returns (h, w, 3), red, green, blue.
    """
    height, width = drawing.shape[0] // 2, drawing.shape[1] // 2
    image = np.empty((height, width, 3), np.uint8)
    for y in range(height):
        above, below = drawing[2 * y], drawing[2 * y + 1]
        for x in range(width):
            for k in range(3):
                upper = np.uint32(above[2 * x, k]) + above[2 * x + 1, k]
                lower = np.uint32(below[2 * x, k]) + below[2 * x + 1, k]
                image[y, x, 2 - k] = (upper + lower + 2) >> 2
    return image


if TYPE_CHECKING:
    import pygame

Point = tuple[float, float]  # place from the left and from above [px]
Box = tuple[float, float, float, float]  # left, top, right, bottom [px]

FACTOR = 2  # drawing pixels per frame pixel, in each direction: what `halved` takes back
TEXT_CACHE = 1024  # rendered texts kept; numbers that change would otherwise fill the memory


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
    """Draws in frame pixels on a surface FACTOR times as large; `image` gives the frame."""

    def __init__(self, width: int, height: int):
        """width, height: size of the frame [px]."""
        self._pygame = load_pygame()
        self._pygame.font.init()
        # The masks of rendered text, without alpha: with others it is drawn 20 times slower.
        masks = (0xFF0000, 0x00FF00, 0x0000FF, 0)
        self._drawing = self._pygame.Surface((FACTOR * width, FACTOR * height), 0, 32, masks)
        self._background = self._drawing.copy()
        self._fonts: dict[int, pygame.font.Font] = {}
        self._texts: dict[tuple[str, int, Colour], pygame.Surface] = {}

    def keep_as_background(self) -> None:
        """What is drawn now is what `clear` returns to."""
        self._background.blit(self._drawing, (0, 0))

    def clear(self, box: Box) -> None:
        """Draw the background over what is in the box."""
        area = self._rect(box)
        self._drawing.blit(self._background, area, area)

    def clip(self, box: Box | None) -> None:
        """Draw only within the box; None: everywhere."""
        self._drawing.set_clip(None if box is None else self._rect(box))

    def image(self) -> NDArray[np.uint8]:
        """The frame, uint8 (height, width, 3): red, green, blue."""
        width, height = self._drawing.get_size()
        # The view locks the surface, so it must not outlive this call.
        memory = np.frombuffer(self._drawing.get_buffer(), np.uint8)
        return halved(memory.reshape(height, width, 4))

    def rectangle(self, box: Box, colour: Colour, *, radius: float = 0.0, outline: float = 0.0) -> None:
        """A filled rectangle, or with outline > 0 [px] its rim; radius of its corners [px]."""
        self._pygame.draw.rect(
            self._drawing,
            colour,
            self._rect(box),
            round(outline * FACTOR),
            border_radius=round(radius * FACTOR),
        )

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
        pieces = [self._rendered(*piece, size, colour) for piece in _pieces(text)]
        total = sum(surface.get_width() for surface, _ in pieces)
        x, y = at[0] * FACTOR - align * total, at[1] * FACTOR
        for surface, drop in pieces:
            self._drawing.blit(surface, (round(x), round(y + drop - surface.get_height() / 2)))
            x += surface.get_width()
        return total / FACTOR

    def _rendered(
        self, text: str, lowered: bool, size: int, colour: Colour
    ) -> "tuple[pygame.Surface, float]":
        size = round(size * FACTOR * (0.74 if lowered else 1.0))
        key = (text, size, colour)
        if key not in self._texts:
            if len(self._texts) >= TEXT_CACHE:
                self._texts.clear()
            if size not in self._fonts:
                self._fonts[size] = self._pygame.font.Font(None, size)
            self._texts[key] = self._fonts[size].render(text, True, colour)
        return self._texts[key], 0.24 * size if lowered else 0.0

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
