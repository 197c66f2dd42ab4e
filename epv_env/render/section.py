"""The valve's section: gas filled by pressure, solid parts, arrows, and the words around them."""

from collections.abc import Sequence

import numpy as np

from epv_env.render import canvas as c
from epv_env.render import geometry as g
from epv_env.render.canvas import Box, Canvas, Colour, Point
from epv_env.render.geometry import Snapshot

AMBIENT_BAR = 1.0  # ambient pressure [bar absolute]
LEAST = 0.04  # strength of flow below which no arrow is drawn [-]


def strength(opening: float, upstream_bar: float, downstream_bar: float) -> float:
    """Flow through a passage as a share of the most it can pass; negative when reversed."""
    drop = upstream_bar - downstream_bar
    high = max(upstream_bar, downstream_bar, 1e-9)
    # From this drop over the upstream pressure the flow no longer grows.
    size = min(max(opening, 0.0), 1.0) * min(1.0, abs(drop) / (0.47 * high)) ** 0.5
    return size if drop >= 0.0 else -size


def chambers(s: Snapshot, m: g.Movers) -> list[tuple[Box, float]]:
    """Every box of gas and its pressure [bar absolute]; later ones lie on earlier ones."""
    left, right = g.PV - g.PISTON, g.PV + g.PISTON
    return [
        *((box, s.p1_bar) for box in (g.INPUT, g.NECK, (left, m.piston_bottom, right, g.FLOOR))),
        (g.OUTPUT, s.p2_bar),
        ((g.PV - g.SEAT_INNER, m.piston_bottom, g.PV + g.SEAT_INNER, g.OUTPUT[1] + 1), s.p2_bar),
        (g.MV_CHAMBER, s.p3_bar),
        ((g.MV - g.TUBE, g.CORE_TIP - 8, g.MV + g.TUBE, g.MV_CHAMBER[1] + 1), s.p3_bar),
        *((box, s.p3_bar) for box in g.DUCT),
        ((left, g.CEILING, right, m.piston_top), s.p3_bar),
        ((g.MV - g.BORE, g.INLET_TIP, g.MV + g.BORE, g.INPUT[1] + 1), s.p1_bar),
        ((g.MV - g.BORE, g.BLOCK[1], g.MV + g.BORE, g.CORE_TIP), AMBIENT_BAR),
    ]


def draw_gas(canvas: Canvas, s: Snapshot, m: g.Movers) -> None:
    """Fill the chambers; one rim around all that are joined."""
    boxes = chambers(s, m)
    for (left, top, right, bottom), _ in boxes:
        canvas.rectangle((left - 1.5, top - 1.5, right + 1.5, bottom + 1.5), c.OUTLINE)
    for box, p_bar in boxes:
        canvas.rectangle(box, c.pressure_colour(p_bar))
    block_left, block_top, block_right, _ = g.BLOCK
    for port in (  # there is no rim where the chambers lead out of the body
        (block_left - 2, g.INPUT[1] - 2, block_left, g.INPUT[3] + 2),
        (block_right, g.OUTPUT[1] - 2, block_right + 2, g.OUTPUT[3] + 2),
        (g.MV - g.BORE - 2, block_top - 2, g.MV + g.BORE + 2, block_top),
    ):
        canvas.rectangle(port, c.CARD)
    if m.piston_bottom < g.SEAT:  # over the open seat's lip the pressure falls from p1 to p2
        high, low = c.pressure_colour(s.p1_bar), c.pressure_colour(s.p2_bar)
        outer, steps = g.SEAT_OUTER + 4.0, 12
        for k in range(steps):
            half = outer + (g.SEAT_INNER - 12.0 - outer) * k / steps
            lip = (g.PV - half, m.piston_bottom, g.PV + half, g.SEAT)
            canvas.rectangle(lip, c.mix(high, low, (k + 1) / steps))


def draw_flows(canvas: Canvas, s: Snapshot, m: g.Movers) -> None:
    """Arrows through every open passage across which there is a pressure drop.

    Their strengths are for the picture only: the plant computes the true flows.
    """
    to_output = strength(s.xPV_fraction, s.p1_bar, s.p2_bar)
    to_control = strength(s.xMV_fraction, s.p1_bar, s.p3_bar)
    to_ambient = strength(1.0 - s.xMV_fraction, s.p3_bar, AMBIENT_BAR)
    for side in (-1.0, 1.0):
        path = _over_the_seat(side, (m.piston_bottom + g.SEAT) / 2)
        _arrow(canvas, path, to_output, 2.0 + 6.0 * abs(to_output))
    _arrow(canvas, [(g.MV, 446), (g.MV, 364)], to_control, 4.0)
    _arrow(canvas, [(299, 352), (299, 226)], to_control - to_ambient, 4.0)
    exhaust = [(g.MV, g.BLOCK[1] - 3), (g.MV, 112.0)]
    _arrow(canvas, exhaust, to_ambient, 7.0, c.pressure_colour(s.p3_bar))
    entering = to_output + 0.15 * to_control
    _arrow(canvas, [(32, 512), (90, 512)], entering, 9.0, c.pressure_colour(s.p1_bar))
    if s.sigma_S_g_per_s > 0.0:
        width = 5.0 + 5.0 * min(1.0, s.sigma_S_g_per_s / 5.0)
        _arrow(canvas, [(597, 556), (652, 556)], 1.0, width, c.pressure_colour(s.p2_bar))


def _over_the_seat(side: float, gap: float) -> list[Point]:
    """Path from the ring chamber over the lip into the seat's bore, as a rounded corner."""
    x0, x1 = g.PV + side * 77.0, g.PV + side * 30.0
    up, middle, down = (x0, g.SEAT + 6.0), ((x0 + x1) / 2, gap), (x1, g.SEAT + 12.0)
    share = np.linspace(0.0, 1.0, 6)[:, None]
    arch = [
        (1 - share) ** 2 * a
        + 2 * share * (1 - share) * b
        + share**2 * end  # from a towards b to the end
        for a, b, end in np.array([(up, (x0, gap), middle), (middle, (x1, gap), down)])
    ]
    bends = np.concatenate(arch).tolist()
    return [(x0, g.FLOOR - 12.0), *bends, (x1, g.SEAT + 78.0)]


def _arrow(
    canvas: Canvas, points: list[Point], signed: float, width: float, colour: Colour = c.CARD
) -> None:
    if abs(signed) >= LEAST:
        canvas.arrow(points if signed > 0 else points[::-1], colour, width, c.INK)


Profile = Sequence[tuple[float, float]]
"""Half widths and heights along the outline of a part that turns around an axis [px]."""


def draw_coil(canvas: Canvas, s: Snapshot) -> None:
    """The windings glow with the current; a bright rim says that the coil is commanded on."""
    glow = abs(s.I_A) / 0.45  # it is brightest at 0.45 A
    copper, wire = c.mix(c.COIL_COLD, c.COIL_HOT, glow), c.mix(c.WIRE_COLD, c.WIRE_HOT, glow)
    for side in (-1, 1):
        left, right = sorted((g.MV + side * (g.TUBE + 8), g.MV + side * (g.TUBE + 52)))
        box = (left, g.COIL_TOP, right, g.COIL_BOTTOM)
        if s.coil_on:
            rim = (left - 5, g.COIL_TOP - 5, right + 5, g.COIL_BOTTOM + 5)
            canvas.rectangle(rim, c.COIL_HOT, radius=6)
        canvas.rectangle(box, copper, radius=3)
        for row in range(8):
            for column in (10, 22, 34):
                canvas.circle((left + column, g.COIL_TOP + 9 + 15.4 * row), 4.6, wire)
        canvas.rectangle(box, c.OUTLINE, radius=3, outline=1.5)


def draw_magnet_valve(canvas: Canvas, m: g.Movers) -> None:
    """Core with the exhaust seat, inlet nozzle, spring, armature."""
    tip, floor = g.CORE_TIP, g.MV_CHAMBER[3] + 1
    _spring(canvas, (g.MV, tip - 8, m.armature_top + g.NOSE_LENGTH), 19.0, coils=4, width=3.0)
    bore = (g.MV - g.BORE, tip - 9, g.MV + g.BORE, tip)
    canvas.rectangle(bore, c.pressure_colour(AMBIENT_BAR))
    core = [(g.BORE, 172), (g.TUBE, 172), (g.TUBE, tip - 9), (12, tip - 9)]
    _halves(canvas, g.MV, [*core, (g.BORE + 3, tip), (g.BORE, tip)], c.IRON)
    nozzle = [(g.BORE, floor), (26, floor), (g.BORE + 4, g.INLET_TIP), (g.BORE, g.INLET_TIP)]
    _halves(canvas, g.MV, nozzle, c.IRON)
    x, top, bottom = g.MV, m.armature_top, m.armature_bottom
    shoulder = top + g.NOSE_LENGTH
    profile = [(g.NOSE, top), (g.NOSE, shoulder), (g.ARMATURE, shoulder), (g.ARMATURE, bottom)]
    _whole(canvas, x, profile, c.STEEL)
    canvas.rectangle((x - g.ARMATURE + 4, shoulder + 4, x - g.ARMATURE + 9, bottom - 4), c.CARD)
    canvas.rectangle((x - 9, top, x + 9, top + 5), c.RUBBER)
    canvas.rectangle((x - 13, bottom - 6, x + 13, bottom), c.RUBBER)


def draw_protection_valve(canvas: Canvas, m: g.Movers) -> None:
    """Spring, the stop within it, seat and piston."""
    _spring(canvas, (g.PV, g.CEILING, m.piston_top), 46.0, coils=5, width=5.0)
    stop = g.SEAT - g.STROKE_PV - g.PISTON_LENGTH - g.BOSS_LENGTH
    _whole(canvas, g.PV, [(16, g.CEILING - 1), (16, stop)], c.BODY)
    foot = [(g.SEAT_INNER, g.FLOOR + 1), (g.SEAT_OUTER, g.FLOOR + 1), (g.SEAT_OUTER, g.SEAT + 22)]
    _halves(canvas, g.PV, [*foot, (g.LIP, g.SEAT), (g.SEAT_INNER, g.SEAT)], c.BODY)
    x, top, bottom = g.PV, m.piston_top, m.piston_bottom
    _whole(canvas, x, [(16, top - g.BOSS_LENGTH), (16, top + 1)], c.STEEL_SHADE)
    _whole(canvas, x, [(g.PISTON, top), (g.PISTON, bottom)], c.STEEL)
    canvas.rectangle((x - g.PISTON + 1, bottom - 18, x + g.PISTON - 1, bottom - 1), c.STEEL_SHADE)
    canvas.rectangle((x - g.SEAT_OUTER, bottom - 8, x + g.SEAT_OUTER, bottom), c.RUBBER)
    for side in (-1.0, 1.0):
        canvas.circle((x + side * (g.PISTON - 4), top + 26), 5.0, c.RUBBER)
    canvas.text("PV piston", (x, top + 26), 19, c.INK, align=0.5)


def _whole(canvas: Canvas, x: float, profile: Profile, colour: Colour) -> None:
    """A solid part, cut along its axis at x."""
    right: list[Point] = [(x + half, y) for half, y in profile]
    left: list[Point] = [(x - half, y) for half, y in reversed(profile)]
    canvas.polygon(right + left, colour, c.OUTLINE)


def _halves(canvas: Canvas, x: float, profile: Profile, colour: Colour) -> None:
    """A hollow part, cut along its axis at x: what is seen left and right of the bore."""
    for side in (-1.0, 1.0):
        canvas.polygon([(x + side * half, y) for half, y in profile], colour, c.OUTLINE)


def _spring(
    canvas: Canvas, place: tuple[float, float, float], half: float, *, coils: int, width: float
) -> None:
    """A coil spring, place: axis, top, bottom; first the wires behind, then those in front."""
    x, top, bottom = place
    pitch = (bottom - top - width) / coils
    heights = [top + width / 2 + pitch * k for k in range(coils)]
    for y in heights:
        canvas.stroke([(x + half, y + pitch / 2), (x - half, y + pitch)], c.MUTED, width)
    for y in heights:
        front = [(x - half, y), (x + half, y + pitch / 2)]
        canvas.stroke(front, c.OUTLINE, width + 1.5)
        canvas.stroke(front, c.STEEL, width - 1.0)


SCALE_BAR = (150.0, 660.0, 536.0, 672.0)  # box of the colour scale [px]


def draw_section_background(canvas: Canvas) -> None:
    """What never moves: the body, names of the valves and ports, the colour scale."""
    left, top, right, bottom = g.BLOCK
    canvas.rectangle(g.BLOCK, c.BODY)
    canvas.clip(g.BLOCK)
    for start in range(int(left - (bottom - top)), int(right), 9):
        canvas.stroke([(start, bottom), (start + bottom - top, top)], c.HATCH, 1.0)
    canvas.clip(None)
    canvas.rectangle(g.BLOCK, c.OUTLINE, outline=1.5)
    canvas.text("Magnet valve (MV)", (g.MV, 91), 19, c.INK, align=0.5)
    canvas.text("Protection valve (PV)", (g.PV, 91), 19, c.INK, align=0.5)
    canvas.text("from", (60, 474), 16, c.MUTED, align=0.5)
    canvas.text("reservoirs", (59, 490), 16, c.MUTED, align=0.5)
    canvas.text("to brake", (625, 516), 16, c.MUTED, align=0.5)
    canvas.text("circuit", (625, 532), 16, c.MUTED, align=0.5)
    left, top, right, bottom = SCALE_BAR
    columns = int(right - left)
    for k in range(columns):
        colour = c.pressure_colour(c.SCALE_TOP_BAR * k / columns)
        canvas.rectangle((left + k, top, left + k + 1, bottom), colour)
    canvas.rectangle(SCALE_BAR, c.OUTLINE, outline=1)
    for p_bar in range(0, int(c.SCALE_TOP_BAR) + 1, 2):
        x = left + (right - left) * p_bar / c.SCALE_TOP_BAR
        canvas.rectangle((x - 0.5, bottom, x + 0.5, bottom + 5), c.OUTLINE)
        canvas.text(str(p_bar), (x, bottom + 14), 16, c.MUTED, align=0.5)
    canvas.text("pressure", (left - 12, top), 16, c.INK, align=1.0)
    canvas.text("bar absolute", (left - 12, top + 15), 16, c.MUTED, align=1.0)
    canvas.text("not to scale,", (right + 14, top), 16, c.MUTED)
    canvas.text("strokes enlarged", (right + 14, top + 15), 16, c.MUTED)


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
    canvas.text(f"x_PV {100 * s.xPV_fraction:.0f} %", (x - 4, g.SEAT - 76), 18, c.INK)
    x, left = 82.0, -1.0
    _gauge(canvas, (x, g.INLET_TIP), g.STROKE_MV, m.armature_bottom, left, ("out", "in"))
    canvas.text(f"x_MV {100 * s.xMV_fraction:.0f} %", (x + 8, g.INLET_TIP - 52), 18, c.INK, align=1.0)


def _gauge(
    canvas: Canvas, zero: Point, stroke: float, now: float, side: float, ends: tuple[str, str]
) -> None:
    """A scale beside the body, its ends named, and a pointer at the height of the moving face."""
    x, y = zero
    canvas.rectangle((x - 1, y - stroke, x + 1, y), c.MUTED)
    for height, words in zip((y, y - stroke), ends, strict=True):
        canvas.stroke([(x, height), (x + side * 6, height)], c.MUTED, 2.0)
        canvas.text(words, (x + side * 11, height), 16, c.MUTED, align=0.0 if side > 0 else 1.0)
    canvas.polygon([(x, now), (x - side * 11, now - 6), (x - side * 11, now + 6)], c.INK)


def _draw_labels(canvas: Canvas, s: Snapshot) -> None:
    _chip(canvas, (205, 538), "Input chamber", "p_1", s.p1_bar, c.P1)
    _chip(canvas, (500, 559), "Output chamber", "p_2", s.p2_bar, c.P2)
    canvas.rectangle((g.PV - 1, 150, g.PV + 1, g.CEILING + 4), c.OUTLINE)
    _chip(canvas, (g.PV, 131), "Control chamber", "p_3", s.p3_bar, c.P3)
    state, colour = ("ON", c.COIL) if s.coil_on else ("OFF", c.MUTED)
    canvas.text(f"{s.sigma_S_g_per_s:.2f} g/s", (625, 582), 16, c.INK, align=0.5)
    canvas.text("coil", (59, 210), 18, c.INK, align=0.5)
    canvas.text(state, (59, 232), 24, colour, align=0.5)
    canvas.text(f"{s.I_A:.2f} A", (59, 254), 18, c.INK, align=0.5)
    for name, opening, at in (
        ("exhaust", 1.0 - s.xMV_fraction, (g.MV + 18, 133)),
        ("inlet", s.xMV_fraction, (106, 404)),
    ):
        words, colour = ("open", c.INK) if opening > 0.02 else ("shut", c.MUTED)
        canvas.text(f"{name} {words}", at, 17, colour)


def _chip(canvas: Canvas, centre: Point, name: str, symbol: str, p_bar: float, colour: Colour) -> None:
    """A white plate with a chamber's name and pressure, in the colour of its line in the chart."""
    x, y = centre
    box = (x - 64, y - 22, x + 64, y + 22)
    canvas.rectangle(box, c.CARD, radius=7)
    canvas.rectangle(box, c.EDGE, radius=7, outline=1)
    canvas.text(name, (x, y - 9), 16, c.MUTED, align=0.5)
    canvas.text(f"{symbol} {p_bar:.2f} bar", (x, y + 9), 19, colour, align=0.5)
