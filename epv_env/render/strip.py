"""The strip chart: pressures with the target's band, coil command and consumption over time."""

from collections import deque
from itertools import count, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from epv_env.render.canvas import (
    BAND,
    CARD,
    COIL,
    CONSUMPTION,
    EDGE,
    GRID,
    INK,
    MUTED,
    P1,
    P2,
    P3,
    SCALE_TOP_BAR,
    TARGET,
    Box,
    Canvas,
    Colour,
    mix,
)
from epv_env.render.geometry import Snapshot
from epv_env.reward import BAND_BAR

SPACING = 19.0  # least distance between two labels at the ends of lines [px]
WINDOW_S = 3.0  # time shown [s]
TICK_S = 0.5  # distance of numbered grid lines [s]

Array = NDArray[np.float64]  # an array of floats


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


def round_up(value: float) -> float:
    """The next of 1, 2, 4, 6, 10, 20, ... at or above the value."""
    least = max(value, 1.0)
    decade = 10.0 ** np.floor(np.log10(least))
    return next(float(m * decade) for m in (1, 2, 4, 6, 10) if m * decade >= least * (1 - 1e-9))


LEFT, RIGHT = 730.0, 1150.0  # ends of the time axis [px]
PRESSURES: Box = (LEFT, 112, RIGHT, 428)  # panel of the pressures [px]
COMMAND: Box = (LEFT, 474, RIGHT, 512)  # panel of the coil's command [px]
CONSUMED: Box = (LEFT, 558, RIGHT, 650)  # panel of the consumption [px]
PER_SECOND = (RIGHT - LEFT) / WINDOW_S  # length of a second on the time axis [px]


class Samples(NamedTuple):
    """What the chart keeps of a snapshot; or of all of them, then every field is an array."""

    time: Array
    """[s]; once drawn: its place [px]."""
    p1: Array
    """Supply pressure [bar absolute]."""
    p2: Array
    """Circuit pressure [bar absolute]."""
    p3: Array
    """Control pressure [bar absolute]."""
    target: Array
    """Target pressure [bar absolute]."""
    coil: Array
    """1 where the coil is on, else 0 [-]."""
    consumption: Array
    """[g/s]."""


class Strip:
    """The last WINDOW_S of snapshots, and their drawing."""

    def __init__(self):
        """Begin without a history."""
        self._history: deque[tuple[float, ...]] = deque()

    def reset(self) -> None:
        """Forget the history."""
        self._history.clear()

    def append(self, s: Snapshot) -> None:
        """Add a snapshot. One of the same time replaces the last, an earlier one begins anew."""
        history = self._history
        if history and s.time_s < history[-1][0]:
            history.clear()
        elif history and s.time_s == history[-1][0]:
            history.pop()
        history.append(
            (s.time_s, s.p1_bar, s.p2_bar, s.p3_bar, s.target_bar, s.coil_on, s.sigma_S_g_per_s)
        )
        # One sample before the window stays, so that the lines begin at the panel's edge.
        while len(history) > 1 and history[1][0] < s.time_s - WINDOW_S:
            history.popleft()

    def draw_background(self, canvas: Canvas) -> None:
        """What never moves: the titles."""
        canvas.text("Pressure [bar absolute]", (LEFT, 90), 18, INK)
        canvas.text("Coil command", (LEFT, COMMAND[1] - 16), 18, INK)
        canvas.text("on", (LEFT - 8, COMMAND[1] + 7), 16, MUTED, align=1.0)
        canvas.text("off", (LEFT - 8, COMMAND[3] - 5), 16, MUTED, align=1.0)
        canvas.text("Consumption [g/s]", (LEFT, CONSUMED[1] - 16), 18, INK)
        canvas.text("time [s]", ((LEFT + RIGHT) / 2, 691), 18, INK, align=0.5)
        words = f"target ±{1000 * BAND_BAR:.0f} mbar"
        width = canvas.text(words, (RIGHT, 90), 18, TARGET, align=1.0)
        canvas.rectangle((RIGHT - width - 32, 83, RIGHT - width - 8, 97), BAND)
        canvas.rectangle((RIGHT - width - 32, 89, RIGHT - width - 8, 91), TARGET)

    def draw(self, canvas: Canvas) -> None:
        """Draw the history."""
        samples = Samples(*np.array(self._history, dtype=float).T)
        begin = max(0.0, float(samples.time[-1]) - WINDOW_S)
        self._draw_time_axis(canvas, begin)
        place = LEFT + PER_SECOND * (samples.time - begin)
        samples = samples._replace(time=place)
        for draw in (self._draw_pressures, _draw_command, _draw_consumption):
            draw(canvas, samples)
        for panel in (PRESSURES, COMMAND, CONSUMED):
            canvas.rectangle(panel, EDGE, outline=1)

    def _draw_time_axis(self, canvas: Canvas, begin: float) -> None:
        """Grid lines through all panels, and their times."""
        first = int(np.ceil(begin / TICK_S - 1e-9))
        for k in count(first):
            x = LEFT + PER_SECOND * (k * TICK_S - begin)
            if x > RIGHT + 0.5:
                break
            for _, top, _, bottom in (PRESSURES, COMMAND, CONSUMED):
                canvas.rectangle((x - 0.5, top, x + 0.5, bottom), GRID)
            canvas.text(f"{k * TICK_S:.10g}", (x, CONSUMED[3] + 14), 16, MUTED, align=0.5)

    def _draw_pressures(self, canvas: Canvas, s: Samples) -> None:
        highest = max(s.p1.max(), s.p2.max(), s.p3.max())
        axis = Axis(PRESSURES, max(SCALE_TOP_BAR, 2.0 * float(np.ceil(highest / 2.0))))
        canvas.clip(PRESSURES)
        self._draw_band(canvas, s, axis)
        canvas.clip(None)
        draw_levels(canvas, axis, 2.0)
        canvas.clip(PRESSURES)
        rows = (
            ("target", s.target, TARGET, 1.5),
            ("p_1", s.p1, P1, 4.0),
            ("p_3", s.p3, P3, 2.0),
            ("p_2", s.p2, P2, 3.0),
        )
        for _, values, colour, width in rows:
            canvas.polyline(axis.points(s.time, values), colour, width)
        canvas.clip(None)
        labels = [
            Label(axis.y(float(values[-1])), f"{name} {values[-1]:.2f}", colour)
            for name, values, colour, _ in rows
        ]
        for label in spread(labels, PRESSURES[1] + 4, PRESSURES[3] - 4):
            canvas.text(label.words, (RIGHT + 10, label.y), 18, label.colour)

    def _draw_band(self, canvas: Canvas, s: Samples, axis: Axis) -> None:
        """The band lies under the whole window: beside the samples their first and last target."""
        ends = run_ends(s.target)
        time = np.concatenate([[LEFT], s.time[ends], [RIGHT]])
        target = np.concatenate([s.target[:1], s.target[ends], s.target[-1:]])
        upper = axis.points(time, target + BAND_BAR)
        lower = axis.points(time, target - BAND_BAR)
        canvas.polygon(np.concatenate([upper, lower[::-1]]).tolist(), BAND)


def _draw_command(canvas: Canvas, s: Samples) -> None:
    """Filled while the coil is commanded on."""
    _, top, _, bottom = COMMAND
    axis = Axis((LEFT, top + 5, RIGHT, bottom - 4), 1.0)
    draw_steps(canvas, s.time, axis, s.coil, COIL)
    state, colour = ("coil on", COIL) if s.coil[-1] else ("coil off", MUTED)
    canvas.text(state, (RIGHT + 10, (top + bottom) / 2), 18, colour)


def _draw_consumption(canvas: Canvas, s: Samples) -> None:
    top = round_up(1.1 * float(s.consumption.max()))
    axis = Axis(CONSUMED, top)
    draw_levels(canvas, axis, top / 2.0)
    draw_steps(canvas, s.time, axis, s.consumption, CONSUMPTION)
    now = float(s.consumption[-1])
    y = min(max(axis.y(now), CONSUMED[1] + 8), CONSUMED[3] - 8)
    canvas.text(f"{now:.2f} g/s", (RIGHT + 10, y), 18, CONSUMPTION)
