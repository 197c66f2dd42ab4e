"""The strip chart: pressures with the target's band, coil command and consumption over time."""

from collections import deque
from collections.abc import Mapping
from dataclasses import fields
from itertools import count, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from epv_env.render import canvas as c
from epv_env.render.canvas import Box, Canvas, Colour
from epv_env.render.geometry import Snapshot
from epv_env.reward import BAND_BAR

SPACING = 19.0  # least distance between two labels at the ends of lines [px]
WINDOW_S = 3.0  # time shown [s]
TICK_S = 0.5  # distance of numbered grid lines [s]

Array = NDArray[np.float64]  # an array of floats


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
        canvas.rectangle((left, y - 0.5, right, y + 0.5), c.GRID)
        canvas.text(f"{value:g}", (left - 8, y), 16, c.MUTED, align=1.0)


def draw_steps(canvas: Canvas, x: Array, axis: Axis, values: Array, colour: Colour) -> None:
    """A staircase, filled to the axis: a value holds from the sample before it to its own."""
    ends = run_ends(values)
    corners = axis.points(np.repeat(x[ends], 2)[:-1], np.repeat(values[ends], 2)[1:])
    left, top, right, base = axis.box
    canvas.clip((left, top - 2, right, base + 2))
    pale = c.mix(c.CARD, colour, 0.25)
    for (x0, _), (x1, y1) in pairwise(corners.tolist()):
        if x1 > x0 and y1 < base:
            canvas.rectangle((x0, y1, x1, base), pale)
    canvas.polyline(corners, colour, 2.0)
    canvas.clip(None)


def run_ends(values: Array) -> NDArray[np.intp]:
    """Indices (k,) at which a run of equal values begins or ends; values: (n,), any unit."""
    changes = np.flatnonzero(np.diff(values))
    return np.unique(np.r_[0, changes, changes + 1, len(values) - 1])


def spread(heights: Array, top: float, bottom: float) -> NDArray:
    """Heights of labels (n,) [px], moved so that none overlaps another or leaves the panel."""
    order = np.argsort(heights, kind="stable")
    down = SPACING * np.arange(len(heights))
    placed = np.maximum.accumulate(np.maximum(heights[order], top) - down) + down
    placed = np.minimum.accumulate((np.minimum(placed, bottom) - down)[::-1])[::-1] + down
    return placed[np.argsort(order)]


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


class Strip:
    """The last WINDOW_S of snapshots, and their drawing."""

    def __init__(self):
        """Begin without a history."""
        self._history: deque[Snapshot] = deque()

    def reset(self) -> None:
        """Forget the history."""
        self._history.clear()

    def append(self, s: Snapshot) -> None:
        """Add a snapshot. One of the same time replaces the last, an earlier one begins anew."""
        history = self._history
        if history and s.time_s < history[-1].time_s:
            history.clear()
        if history and s.time_s == history[-1].time_s:
            history.pop()
        history.append(s)
        # One sample before the window stays, so that the lines begin at the panel's edge.
        while len(history) > 1 and history[1].time_s < s.time_s - WINDOW_S:
            history.popleft()

    def draw_background(self, canvas: Canvas) -> None:
        """What never moves: the titles."""
        canvas.text("Pressure [bar absolute]", (LEFT, 90), 18, c.INK)
        canvas.text("Coil command", (LEFT, COMMAND[1] - 16), 18, c.INK)
        canvas.text("on", (LEFT - 8, COMMAND[1] + 7), 16, c.MUTED, align=1.0)
        canvas.text("off", (LEFT - 8, COMMAND[3] - 5), 16, c.MUTED, align=1.0)
        canvas.text("Consumption [g/s]", (LEFT, CONSUMED[1] - 16), 18, c.INK)
        canvas.text("time [s]", ((LEFT + RIGHT) / 2, 691), 18, c.INK, align=0.5)
        words = f"target ±{1000 * BAND_BAR:.0f} mbar"
        width = canvas.text(words, (RIGHT, 90), 18, c.TARGET, align=1.0)
        canvas.rectangle((RIGHT - width - 32, 83, RIGHT - width - 8, 97), c.BAND)
        canvas.rectangle((RIGHT - width - 32, 89, RIGHT - width - 8, 91), c.TARGET)

    def draw(self, canvas: Canvas) -> None:
        """Draw the history."""
        s = {
            entry.name: np.array(
                [getattr(snapshot, entry.name) for snapshot in self._history], dtype=float
            )
            for entry in fields(Snapshot)
        }
        begin = max(0.0, float(s["time_s"][-1]) - WINDOW_S)
        self._draw_time_axis(canvas, begin)
        x = LEFT + PER_SECOND * (s["time_s"] - begin)
        _draw_pressures(canvas, x, s)
        _draw_command(canvas, x, s["coil_on"])
        _draw_consumption(canvas, x, s["sigma_S_g_per_s"])
        for panel in (PRESSURES, COMMAND, CONSUMED):
            canvas.rectangle(panel, c.EDGE, outline=1)

    def _draw_time_axis(self, canvas: Canvas, begin: float) -> None:
        """Grid lines through all panels, and their times."""
        first = int(np.ceil(begin / TICK_S - 1e-9))
        for k in count(first):
            x = LEFT + PER_SECOND * (k * TICK_S - begin)
            if x > RIGHT + 0.5:
                break
            for _, top, _, bottom in (PRESSURES, COMMAND, CONSUMED):
                canvas.rectangle((x - 0.5, top, x + 0.5, bottom), c.GRID)
            canvas.text(f"{k * TICK_S:.10g}", (x, CONSUMED[3] + 14), 16, c.MUTED, align=0.5)


def _draw_pressures(canvas: Canvas, x: Array, s: Mapping[str, Array]) -> None:
    """x: places of the samples [px]. s: fields of the snapshots, (samples,) each."""
    target = s["target_bar"]
    rows = (
        ("target", target, c.TARGET, 1.5),
        ("p_1", s["p1_bar"], c.P1, 4.0),
        ("p_3", s["p3_bar"], c.P3, 2.0),
        ("p_2", s["p2_bar"], c.P2, 3.0),
    )
    highest = max(float(values.max()) for _, values, *_ in rows[1:])
    axis = Axis(PRESSURES, max(c.SCALE_TOP_BAR, 2.0 * float(np.ceil(highest / 2.0))))
    # The band lies under the whole window: beside the samples their first and last target.
    time, middle = np.r_[LEFT, x, RIGHT], np.r_[target[0], target, target[-1]]
    upper, lower = (axis.points(time, middle + side * BAND_BAR) for side in (1, -1))
    canvas.clip(PRESSURES)
    canvas.polygon(np.concatenate([upper, lower[::-1]]).tolist(), c.BAND)
    canvas.clip(None)
    draw_levels(canvas, axis, 2.0)
    canvas.clip(PRESSURES)
    for _, values, colour, width in rows:
        canvas.polyline(axis.points(x, values), colour, width)
    canvas.clip(None)
    heights = np.array([axis.y(float(values[-1])) for _, values, *_ in rows])
    places = spread(heights, PRESSURES[1] + 4, PRESSURES[3] - 4).tolist()
    for y, (name, values, colour, _) in zip(places, rows, strict=True):
        canvas.text(f"{name} {values[-1]:.2f}", (RIGHT + 10, y), 18, colour)


def _draw_command(canvas: Canvas, x: Array, coil: Array) -> None:
    """Filled while the coil is commanded on."""
    _, top, _, bottom = COMMAND
    draw_steps(canvas, x, Axis((LEFT, top + 5, RIGHT, bottom - 4), 1.0), coil, c.COIL)
    state, colour = ("coil on", c.COIL) if coil[-1] else ("coil off", c.MUTED)
    canvas.text(state, (RIGHT + 10, (top + bottom) / 2), 18, colour)


def _draw_consumption(canvas: Canvas, x: Array, consumption: Array) -> None:
    axis = Axis(CONSUMED, round_up(1.1 * float(consumption.max())))
    draw_levels(canvas, axis, axis.top / 2.0)
    draw_steps(canvas, x, axis, consumption, c.CONSUMPTION)
    now = float(consumption[-1])
    y = min(max(axis.y(now), CONSUMED[1] + 8), CONSUMED[3] - 8)
    canvas.text(f"{now:.2f} g/s", (RIGHT + 10, y), 18, c.CONSUMPTION)
