"""The strip chart: pressures with the target's band, coil command and consumption over time."""

from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.render import canvas as c
from epv_env.render.canvas import Box, Canvas, Colour
from epv_env.render.geometry import Snapshot
from epv_env.reward import BAND_BAR

Array = NDArray[np.float64]  # an array of floats

SPACING = 19.0  # least distance between two labels at the ends of curves [px]
WINDOW_S, TICK_S = 3.0, 0.5  # time shown, distance of numbered grid lines [s]
LEFT, RIGHT, BESIDE = 730.0, 1150.0, 1160.0  # ends of the time axis, latest values [px]
SECOND = (RIGHT - LEFT) / WINDOW_S  # length of a second [px]
PRESSURES: Box = (LEFT, 112, RIGHT, 428)
COMMAND: Box = (LEFT, 474, RIGHT, 512)
SWITCHED: Box = (LEFT, 479, RIGHT, 508)  # from off to on
CONSUMED: Box = (LEFT, 558, RIGHT, 650)
TITLES = (  # text, place [px], size, colour, alignment
    (f"target ±{1000 * BAND_BAR:.0f} mbar", (RIGHT, 90.0), 18, c.TARGET, 1.0),
    ("Pressure [bar absolute]", (LEFT, 90.0), 18, c.INK, 0.0),
    ("Coil command", (LEFT, 458.0), 18, c.INK, 0.0),
    ("on", (LEFT - 8, 481.0), 16, c.MUTED, 1.0),
    ("off", (LEFT - 8, 507.0), 16, c.MUTED, 1.0),
    ("Consumption [g/s]", (LEFT, 542.0), 18, c.INK, 0.0),
    ("time [s]", ((LEFT + RIGHT) / 2, 691.0), 18, c.INK, 0.5),
)
CURVES = (  # name, field, colour, width [px]; later ones lie on earlier ones
    ("target", "target_bar", c.TARGET, 1.5),
    ("p_1", "p1_bar", c.P1, 4.0),
    ("p_3", "p3_bar", c.P3, 2.0),
    ("p_2", "p2_bar", c.P2, 3.0),
)


def round_up(value: float) -> float:
    """The next of 1, 2, 4, 6, 10, 20, ... at or above the value."""
    decade = 10.0 ** np.floor(np.log10(max(value, 1.0)))
    return next(float(m * decade) for m in (1, 2, 4, 6, 10) if m * decade >= value * (1 - 1e-9))


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
        # One sample before the window stays, so that the curves begin at the panel's edge.
        while len(history) > 1 and history[1].time_s < s.time_s - WINDOW_S:
            history.popleft()

    def draw(self, canvas: Canvas) -> None:
        """Draw the history."""
        columns = np.array(self._history, dtype=float).T
        s = dict(zip(Snapshot._fields, columns, strict=True))
        begin = max(0.0, float(s["time_s"][-1]) - WINDOW_S)
        x = np.maximum(LEFT, LEFT + SECOND * (s["time_s"] - begin))
        _draw_time_axis(canvas, begin)
        _draw_pressures(canvas, x, s)
        _draw_command(canvas, x, s["coil_on"])
        _draw_consumption(canvas, x, s["sigma_S_g_per_s"])
        for panel in (PRESSURES, COMMAND, CONSUMED):
            canvas.rectangle(panel, c.EDGE, outline=1)


def draw_strip_background(canvas: Canvas) -> None:
    """What never moves: the titles, and a sample of the band."""
    width, *_ = [canvas.text(*title) for title in TITLES]
    right = RIGHT - width - 8
    canvas.rectangle((right - 24, 83, right, 97), c.BAND)
    canvas.rectangle((right - 24, 89, right, 91), c.TARGET)


def _draw_time_axis(canvas: Canvas, begin: float) -> None:
    """Grid lines through all panels, and their times."""
    first, last = np.ceil(begin / TICK_S - 1e-9), np.floor((begin + WINDOW_S) / TICK_S + 1e-9)
    for time in TICK_S * np.arange(max(0.0, first), last + 1):
        x = LEFT + SECOND * (time - begin)
        for _, top, _, bottom in (PRESSURES, COMMAND, CONSUMED):
            canvas.rectangle((x - 0.5, top, x + 0.5, bottom), c.GRID)
        canvas.text(f"{time:.10g}", (x, CONSUMED[3] + 14), 16, c.MUTED, 0.5)


def _height(box: Box, top: float, values: Any) -> Any:
    """Heights [px] of values on an axis from 0 at the box's lower edge to `top` at its upper one."""
    return box[3] - (box[3] - box[1]) / top * values


def _draw_levels(canvas: Canvas, box: Box, top: float, step: float) -> None:
    """Horizontal grid lines and their numbers."""
    for value in np.arange(0.0, top + step / 2, step):
        y = float(_height(box, top, value))
        canvas.rectangle((LEFT, y - 0.5, RIGHT, y + 0.5), c.GRID)
        canvas.text(f"{value:g}", (LEFT - 8, y), 16, c.MUTED, 1.0)


def _draw_steps(canvas: Canvas, x: Array, y: Array, base: float, colour: Colour) -> None:
    """A staircase, filled to its base: a value holds from the sample before it to its own."""
    changes = np.diff(y) != 0.0
    ends = np.r_[True, changes] | np.r_[changes, True]  # where a run of equal values begins or ends
    x, y = x[ends], y[ends]
    corners = np.column_stack([np.repeat(x, 2)[:-1], np.repeat(y, 2)[1:]])
    if len(x) > 1 and y.min() < base:
        canvas.polygon([(x[0], base), *corners.tolist(), (x[-1], base)], c.blend(0.25, c.CARD, colour))
    canvas.polyline(corners, colour, 2.0)


def _draw_pressures(canvas: Canvas, x: Array, s: dict[str, Array]) -> None:
    """x: places of the samples [px]. s: fields of the snapshots, (samples,) each."""
    highest = max(s[field].max() for field in ("p1_bar", "p2_bar", "p3_bar"))
    top = max(c.SCALE_TOP_BAR, 2.0 * float(np.ceil(highest / 2.0)))
    y = {field: _height(PRESSURES, top, s[field]) for _, field, *_ in CURVES}
    half = BAND_BAR * (PRESSURES[3] - PRESSURES[1]) / top
    # The band lies under the whole window: beside the samples their first and last target.
    wide, middle = np.r_[LEFT, x, RIGHT], np.pad(y["target_bar"], 1, "edge")
    edges = np.clip(np.r_[middle - half, middle[::-1] + half], PRESSURES[1], PRESSURES[3])
    canvas.polygon(list(zip(np.r_[wide, wide[::-1]], edges, strict=True)), c.BAND)
    _draw_levels(canvas, PRESSURES, top, 2.0)
    for _, field, colour, width in CURVES:
        canvas.polyline(np.column_stack([x, y[field]]), colour, width)
    lowest = PRESSURES[1] + 4 - SPACING
    for name, field, colour, _ in sorted(CURVES, key=lambda curve: y[curve[1]][-1]):
        lowest = max(float(y[field][-1]), lowest + SPACING)  # no label overlaps the one before
        canvas.text(f"{name} {s[field][-1]:.2f}", (BESIDE, lowest), 18, colour)


def _draw_command(canvas: Canvas, x: Array, coil: Array) -> None:
    """Filled while the coil is commanded on."""
    _draw_steps(canvas, x, _height(SWITCHED, 1.0, coil), SWITCHED[3], c.COIL)
    state, colour = ("coil on", c.COIL) if coil[-1] else ("coil off", c.MUTED)
    canvas.text(state, (BESIDE, (COMMAND[1] + COMMAND[3]) / 2), 18, colour)


def _draw_consumption(canvas: Canvas, x: Array, consumption: Array) -> None:
    top = round_up(1.1 * float(consumption.max()))
    y = _height(CONSUMED, top, consumption)
    _draw_levels(canvas, CONSUMED, top, top / 2.0)
    _draw_steps(canvas, x, y, CONSUMED[3], c.CONSUMPTION)
    place = float(np.clip(y[-1], CONSUMED[1] + 8, CONSUMED[3] - 8))
    canvas.text(f"{consumption[-1]:.2f} g/s", (BESIDE, place), 18, c.CONSUMPTION)
