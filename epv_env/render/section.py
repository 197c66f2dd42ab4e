"""The valve's section: what is drawn in which order, and the words around it."""

from epv_env.render import geometry as g
from epv_env.render.canvas import Canvas, Point
from epv_env.render.gas import draw_flows, draw_gas
from epv_env.render.palette import (
    BODY,
    CARD,
    COIL,
    EDGE,
    HATCH,
    INK,
    MUTED,
    OUTLINE,
    P1,
    P2,
    P3,
    SCALE_TOP_BAR,
    Colour,
    pressure_colour,
)
from epv_env.render.parts import draw_coil, draw_magnet_valve, draw_protection_valve
from epv_env.render.snapshot import Snapshot

SCALE_BAR = (150.0, 660.0, 536.0, 672.0)
"""Box of the colour scale [px]."""


def draw_section_background(canvas: Canvas) -> None:
    """What never moves: the body, names of the valves and ports, the colour scale."""
    left, top, right, bottom = g.BLOCK
    canvas.rectangle(g.BLOCK, BODY)
    canvas.clip(g.BLOCK)
    for start in range(int(left - (bottom - top)), int(right), 9):
        canvas.stroke([(start, bottom), (start + bottom - top, top)], HATCH, 1.0)
    canvas.clip(None)
    canvas.rectangle(g.BLOCK, OUTLINE, outline=1.5)
    canvas.text("Magnet valve (MV)", (g.MV, 91), 19, INK, align=0.5)
    canvas.text("Protection valve (PV)", (g.PV, 91), 19, INK, align=0.5)
    canvas.text("from", (60, 474), 16, MUTED, align=0.5)
    canvas.text("reservoirs", (59, 490), 16, MUTED, align=0.5)
    canvas.text("to brake", (625, 516), 16, MUTED, align=0.5)
    canvas.text("circuit", (625, 532), 16, MUTED, align=0.5)
    _draw_scale(canvas)


def _draw_scale(canvas: Canvas) -> None:
    left, top, right, bottom = SCALE_BAR
    columns = int(right - left)
    for k in range(columns):
        colour = pressure_colour(SCALE_TOP_BAR * k / columns)
        canvas.rectangle((left + k, top, left + k + 1, bottom), colour)
    canvas.rectangle(SCALE_BAR, OUTLINE, outline=1)
    for p_bar in range(0, int(SCALE_TOP_BAR) + 1, 2):
        x = left + (right - left) * p_bar / SCALE_TOP_BAR
        canvas.rectangle((x - 0.5, bottom, x + 0.5, bottom + 5), OUTLINE)
        canvas.text(str(p_bar), (x, bottom + 14), 16, MUTED, align=0.5)
    canvas.text("pressure", (left - 12, top), 16, INK, align=1.0)
    canvas.text("bar absolute", (left - 12, top + 15), 16, MUTED, align=1.0)
    canvas.text("not to scale,", (right + 14, top), 16, MUTED)
    canvas.text("strokes enlarged", (right + 14, top + 15), 16, MUTED)


def draw_section(canvas: Canvas, s: Snapshot) -> None:
    """Everything that depends on the snapshot."""
    m = g.movers(s)
    draw_gas(canvas, s, m)
    draw_coil(canvas, s)
    draw_magnet_valve(canvas, m)
    draw_protection_valve(canvas, m)
    draw_flows(canvas, s, m)
    _draw_gauges(canvas, s, m)
    _draw_labels(canvas, s)


def _draw_gauges(canvas: Canvas, s: Snapshot, m: g.Movers) -> None:
    x, right = 606.0, 1.0
    _gauge(canvas, (x, g.SEAT), g.STROKE_PV, m.piston_bottom, right, ("shut", "open"))
    canvas.text(f"x_PV {100 * s.xPV_fraction:.0f} %", (x - 4, g.SEAT - 76), 18, INK)
    x, left = 82.0, -1.0
    _gauge(canvas, (x, g.INLET_TIP), g.STROKE_MV, m.armature_bottom, left, ("out", "in"))
    canvas.text(f"x_MV {100 * s.xMV_fraction:.0f} %", (x + 8, g.INLET_TIP - 52), 18, INK, align=1.0)


def _gauge(
    canvas: Canvas, zero: Point, stroke: float, now: float, side: float, ends: tuple[str, str]
) -> None:
    """A scale beside the body, its ends named, and a pointer at the height of the moving face."""
    x, y = zero
    canvas.rectangle((x - 1, y - stroke, x + 1, y), MUTED)
    for height, words in zip((y, y - stroke), ends, strict=True):
        canvas.stroke([(x, height), (x + side * 6, height)], MUTED, 2.0)
        canvas.text(words, (x + side * 11, height), 16, MUTED, align=0.0 if side > 0 else 1.0)
    canvas.polygon([(x, now), (x - side * 11, now - 6), (x - side * 11, now + 6)], INK)


def _draw_labels(canvas: Canvas, s: Snapshot) -> None:
    _chip(canvas, (205, 538), "Input chamber", "p_1", s.p1_bar, P1)
    _chip(canvas, (500, 559), "Output chamber", "p_2", s.p2_bar, P2)
    canvas.rectangle((g.PV - 1, 150, g.PV + 1, g.CEILING + 4), OUTLINE)
    _chip(canvas, (g.PV, 131), "Control chamber", "p_3", s.p3_bar, P3)
    state, colour = ("ON", COIL) if s.coil_on else ("OFF", MUTED)
    canvas.text(f"{s.sigma_S_g_per_s:.2f} g/s", (625, 582), 16, INK, align=0.5)
    canvas.text("coil", (59, 210), 18, INK, align=0.5)
    canvas.text(state, (59, 232), 24, colour, align=0.5)
    canvas.text(f"{s.I_A:.2f} A", (59, 254), 18, INK, align=0.5)
    _seat_label(canvas, "exhaust", 1.0 - s.xMV_fraction, (g.MV + 18, 133))
    _seat_label(canvas, "inlet", s.xMV_fraction, (106, 404))


def _seat_label(canvas: Canvas, name: str, opening: float, at: Point) -> None:
    is_open = opening > 0.02
    words = f"{name} open" if is_open else f"{name} shut"
    canvas.text(words, at, 17, INK if is_open else MUTED)


def _chip(canvas: Canvas, centre: Point, name: str, symbol: str, p_bar: float, colour: Colour) -> None:
    """A white plate with a chamber's name and pressure, in the colour of its line in the chart."""
    x, y = centre
    box = (x - 64, y - 22, x + 64, y + 22)
    canvas.rectangle(box, CARD, radius=7)
    canvas.rectangle(box, EDGE, radius=7, outline=1)
    canvas.text(name, (x, y - 9), 16, MUTED, align=0.5)
    canvas.text(f"{symbol} {p_bar:.2f} bar", (x, y + 9), 19, colour, align=0.5)
