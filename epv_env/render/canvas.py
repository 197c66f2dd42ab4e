"""A pygame surface with anti-aliased shapes and text: drawn at twice the size, then averaged."""

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
from epv_env.render.average import halved
from epv_env.render.palette import Colour

if TYPE_CHECKING:
    import pygame

Point = tuple[float, float]
"""Place from the left and from above [px]."""
Box = tuple[float, float, float, float]
"""Left, top, right, bottom [px]."""

FACTOR = 2
"""Drawing pixels per frame pixel, in each direction: what average.halved takes back."""
TEXT_CACHE = 1024
"""Rendered texts kept; numbers that change would otherwise fill the memory."""


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
