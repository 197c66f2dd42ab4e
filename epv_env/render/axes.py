"""Axes of the strip chart: from values to heights, grid lines, staircases, labels apart."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from epv_env.render.canvas import Box, Canvas
from epv_env.render.palette import CARD, GRID, MUTED, Colour, mix

SPACING = 19.0
"""Least distance between two labels at the ends of lines [px]."""
MOST_TICKS = 7
"""Largest number of numbered grid lines."""

Array = NDArray[np.float64]
"""An array of floats."""


class Label(NamedTuple):
    """Words at the end of a line, and the height at which they should stand [px]."""

    y: float
    """Height of the words [px]."""
    words: str
    """The text."""
    colour: Colour
    """Colour of the text."""


class Axis(NamedTuple):
    """A panel's vertical axis: 0 at its lower edge, `top` at its upper one."""

    box: Box
    """Left, upper, right and lower edge [px]."""
    top: float
    """Value at the upper edge."""

    def y(self, value: float) -> float:
        """Height of a value [px]."""
        return self.box[3] - (self.box[3] - self.box[1]) * value / self.top

    def points(self, x: Array, values: Array) -> Array:
        """Points of a line, shape (n, 2) [px]; x: their places [px]."""
        y = self.box[3] - (self.box[3] - self.box[1]) / self.top * values
        return np.column_stack([x, y])


def draw_levels(canvas: Canvas, axis: Axis, step: float) -> None:
    """Horizontal grid lines and their numbers."""
    left, _, right, _ = axis.box
    for value in np.arange(0.0, axis.top + step / 2, step).tolist():
        y = axis.y(value)
        canvas.rectangle((left, y - 0.5, right, y + 0.5), GRID)
        canvas.text(f"{value:g}", (left - 8, y), 16, MUTED, align=1.0)


def draw_steps(canvas: Canvas, x: Array, axis: Axis, values: Array, colour: Colour) -> None:
    """A staircase, filled to the axis: a value holds from the sample before it to its own."""
    ends = run_ends(values)
    corners = axis.points(np.repeat(x[ends], 2)[:-1], np.repeat(values[ends], 2)[1:])
    left, top, right, base = axis.box
    canvas.clip((left, top - 2, right, base + 2))
    pale = mix(CARD, colour, 0.25)
    for (x0, _), (x1, y1) in pairwise(corners.tolist()):
        if x1 > x0 and y1 < base:
            canvas.rectangle((x0, y1, x1, base), pale)
    canvas.polyline(corners, colour, 2.0)
    canvas.clip(None)


def run_ends(values: Array) -> NDArray[np.intp]:
    """Indices (k,) at which a run of equal values begins or ends; values: (n,), any unit."""
    changes = np.flatnonzero(np.diff(values))
    return np.unique(np.concatenate([[0], changes, changes + 1, [len(values) - 1]]))


def spread(labels: list[Label], top: float, bottom: float) -> list[Label]:
    """The labels from above, moved so that none overlaps another or leaves the panel."""
    placed: list[Label] = []
    for label in sorted(labels, key=lambda label: label.y):
        least = placed[-1].y + SPACING if placed else top
        placed.append(label._replace(y=max(label.y, least)))
    limit = bottom
    for k in reversed(range(len(placed))):
        placed[k] = placed[k]._replace(y=min(placed[k].y, limit))
        limit = placed[k].y - SPACING
    return placed


def time_step(window_s: float) -> float:
    """Distance of the ticks [s]: the least of .. 0.1, 0.2, 0.5, 1 .. that gives at most 7."""
    return _next_of((1, 2, 5, 10), window_s / MOST_TICKS)


def round_up(value: float) -> float:
    """The next of 1, 2, 4, 6, 10, 20, ... at or above the value."""
    return _next_of((1, 2, 4, 6, 10), max(value, 1.0))


def _next_of(multiples: tuple[int, ...], value: float) -> float:
    decade = 10.0 ** np.floor(np.log10(value))
    return next(float(m * decade) for m in multiples if m * decade >= value * (1 - 1e-9))
