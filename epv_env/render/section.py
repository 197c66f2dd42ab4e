"""The valve's section: gas filled by pressure, solid parts, arrows, and the words around them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from epv_env.render import canvas as c
from epv_env.render import geometry as g
from epv_env.render.canvas import Canvas, Point
from epv_env.render.geometry import Snapshot

AMBIENT_BAR = 1.0  # ambient pressure [bar absolute]
LEAST = 0.04  # strength of flow below which no arrow is drawn [-]
CHOKED = 0.47  # pressure drop over the upstream pressure from which the flow no longer grows [-]


def draw_section_background(canvas: Canvas) -> None:
    """What never moves: the body, names of the valves and ports, the colour scale."""
    left, top, right, bottom = g.BLOCK
    canvas.rectangle(g.BLOCK, c.BODY)
    canvas.surface.set_clip(canvas.rect(g.BLOCK))
    for start in range(int(left - (bottom - top)), int(right), 9):
        canvas.stroke([(start, bottom), (start + bottom - top, top)], c.HATCH, 1.0)
    canvas.surface.set_clip(None)
    canvas.rectangle(g.BLOCK, c.OUTLINE, outline=1.5)
    for name in g.NAMES:
        canvas.text(*name)
    left, top, right, bottom = g.SCALE
    per_bar = (right - left) / c.SCALE_TOP_BAR
    for x in np.arange(left, right).tolist():
        canvas.rectangle((x, top, x + 1, bottom), c.pressure_colour((x - left) / per_bar))
    canvas.rectangle(g.SCALE, c.OUTLINE, outline=1)
    for p_bar in range(0, int(c.SCALE_TOP_BAR) + 1, 2):
        x = left + p_bar * per_bar
        canvas.rectangle((x - 0.5, bottom, x + 0.5, bottom + 5), c.OUTLINE)
        canvas.text(str(p_bar), (x, bottom + 14), 16, c.MUTED, 0.5)


def draw_section(canvas: Canvas, s: Snapshot) -> None:
    """Everything that depends on the snapshot."""
    opening = {"armature": s.xMV_fraction, "piston": s.xPV_fraction, "": 0.0}
    lift = {part: g.STROKE[part] * min(max(share, 0.0), 1.0) for part, share in opening.items()}
    _draw_gas(canvas, {**s._asdict(), "ambient": AMBIENT_BAR}, lift)
    _draw_coil(canvas, s)
    for axis, half, top, bottom, mover, coils, width in g.SPRINGS:
        _draw_spring(canvas, (axis - half, top, axis + half, bottom - lift[mover]), coils, width)
    for part in g.PARTS:
        _draw_part(canvas, part, lift[part.mover])
    canvas.text("PV piston", (g.PV, 362 - lift["piston"]), 19, c.INK, 0.5)
    _draw_flows(canvas, s, lift["piston"])
    for zero, mover, side, ends in g.GAUGES:
        _draw_gauge(canvas, zero, g.STROKE[mover], lift[mover], side, ends)
    _draw_words(canvas, s)


def _draw_gas(canvas: Canvas, values: dict[str, Any], lift: dict[str, float]) -> None:
    """Fill the chambers; one rim around all that are joined."""
    boxes = []
    for gas in g.GAS:
        left, top, right, bottom = gas.box
        box = (left, top - lift[gas.top], right, bottom - lift[gas.bottom])
        boxes.append((box, c.pressure_colour(values[gas.pressure])))
    for (left, top, right, bottom), _ in boxes:
        canvas.rectangle((left - 1.5, top - 1.5, right + 1.5, bottom + 1.5), c.OUTLINE)
    for box, colour in [*boxes, *((port, c.CARD) for port in g.PORTS)]:
        canvas.rectangle(box, colour)
    if lift["piston"] > 0.0:  # over the open seat's lip the pressure falls from p1 to p2
        high, low = c.pressure_colour(values["p1_bar"]), c.pressure_colour(values["p2_bar"])
        for share in np.linspace(0.0, 1.0, 12):
            half = np.interp(share, (0.0, 1.0), g.LIP)
            lip = (g.PV - half, g.SEAT - lift["piston"], g.PV + half, g.SEAT)
            canvas.rectangle(lip, c.blend(share, high, low))


def _draw_coil(canvas: Canvas, s: Snapshot) -> None:
    """The windings glow with the current; a bright rim says that the coil is commanded on."""
    glow = abs(s.I_A) / g.BRIGHT_A
    copper, wire = c.blend(glow, c.COIL_COLD, c.COIL_HOT), c.blend(glow, c.WIRE_COLD, c.WIRE_HOT)
    for box in g.WINDINGS:
        left, top, right, bottom = box
        if s.coil_on:
            canvas.rectangle((left - 5, top - 5, right + 5, bottom + 5), c.COIL_HOT, radius=6)
        canvas.rectangle(box, copper, radius=3)
        for x, y in g.WIRES:
            canvas.circle((left + x, top + y), g.WIRE, wire)
        canvas.rectangle(box, c.OUTLINE, radius=3, outline=1.5)


def _draw_spring(canvas: Canvas, box: c.Box, coils: int, width: float) -> None:
    """A coil spring: first the wires behind, then those in front."""
    left, top, right, bottom = box
    pitch = (bottom - top - width) / coils
    heights = [top + width / 2 + pitch * k for k in range(coils)]
    for y in heights:
        canvas.stroke([(right, y + pitch / 2), (left, y + pitch)], c.MUTED, width)
    for y in heights:
        front = [(left, y), (right, y + pitch / 2)]
        canvas.stroke(front, c.OUTLINE, width + 1.5)
        canvas.stroke(front, c.STEEL, width - 1.0)


def _draw_part(canvas: Canvas, part: g.Part, lift: float) -> None:
    left, right = ([(part.axis + side * half, y - lift) for half, y in part.profile] for side in (-1, 1))
    for outline in (left, right) if part.hollow else (right + left[::-1],):
        canvas.polygon(outline, part.colour, part.rim)


def _strength(opening: float, upstream_bar: float, downstream_bar: float) -> float:
    """Flow through a passage as a share of the most it can pass; negative when reversed."""
    drop = upstream_bar - downstream_bar
    highest = max(upstream_bar, downstream_bar, 1e-9)
    size = min(max(opening, 0.0), 1.0) * min(1.0, abs(drop) / (CHOKED * highest)) ** 0.5
    return size if drop > 0.0 else -size


def _draw_flows(canvas: Canvas, s: Snapshot, lift: float) -> None:
    """Arrows through every open passage across which there is a pressure drop.

    Their strengths are for the picture only: the plant computes the true flows.
    """
    inlet = _strength(s.xMV_fraction, s.p1_bar, s.p3_bar)
    seat = _strength(s.xPV_fraction, s.p1_bar, s.p2_bar)
    exhaust = _strength(1.0 - s.xMV_fraction, s.p3_bar, AMBIENT_BAR)
    strength = {"inlet": inlet, "duct": inlet - exhaust, "exhaust": exhaust}
    strength |= {"entering": seat + 0.15 * inlet, "consumption": float(s.sigma_S_g_per_s > 0.0)}
    over_the_seat = 2.0 + 6.0 * abs(seat)
    arrows: list[tuple[float, Sequence[Point], float, str | None]] = [
        (seat, _over_the_seat(side, lift), over_the_seat, None) for side in (-1.0, 1.0)
    ]
    arrows += [(strength[name], path, width, pressure) for name, path, width, pressure in g.FLOWS]
    for signed, path, width, pressure in arrows:
        if abs(signed) >= LEAST:
            colour = c.pressure_colour(getattr(s, pressure)) if pressure else c.CARD
            canvas.arrow(path if signed > 0 else path[::-1], colour, width, c.INK)


def _over_the_seat(side: float, lift: float) -> list[Point]:
    """Path from the ring chamber over the lip into the seat's bore, as a half ellipse."""
    inner, outer, bend, tip, tail = g.OVER_SEAT
    angle = np.linspace(0.0, np.pi, 9)
    x = g.PV + side * ((outer + inner) / 2 + (outer - inner) / 2 * np.cos(angle))
    y = bend - (bend - g.SEAT + lift / 2) * np.sin(angle)
    return [(x[0], tail), *zip(x, y, strict=True), (x[-1], tip)]


def _draw_gauge(
    canvas: Canvas, zero: Point, stroke: float, lift: float, side: float, ends: tuple[str, str]
) -> None:
    """A scale beside the body, its ends named, and a pointer at the height of the moving face."""
    x, y = zero
    canvas.rectangle((x - 1, y - stroke, x + 1, y), c.MUTED)
    for height, words in zip((y, y - stroke), ends, strict=True):
        canvas.stroke([(x, height), (x + side * 6, height)], c.MUTED, 2.0)
        canvas.text(words, (x + side * 11, height), 16, c.MUTED, 0.5 - side / 2)
    tail = x - side * 11
    canvas.polygon([(x, y - lift), (tail, y - lift - 6), (tail, y - lift + 6)], c.INK)


def _draw_words(canvas: Canvas, s: Snapshot) -> None:
    """Names and values; a chamber's stand on a plate, in the colour of its curve in the chart."""
    values = {**s._asdict(), "xPV": 100 * s.xPV_fraction, "xMV": 100 * s.xMV_fraction}
    canvas.rectangle(g.POINTER, c.OUTLINE)
    for name, value, (x, y), colour in g.CHIPS:
        box = (x - 64, y - 22, x + 64, y + 22)
        canvas.plate(box, 7)
        canvas.text(name, (x, y - 9), 16, c.MUTED, 0.5)
        canvas.text(value.format(**values), (x, y + 9), 19, colour, 0.5)
    for words, at, size, colour, align in g.VALUES:
        canvas.text(words.format(**values), at, size, colour, align)
    open_ = {"coil": s.coil_on, "inlet": s.xMV_fraction > 0.02, "exhaust": s.xMV_fraction < 0.98}
    for name, words, at, size, colour, align in g.STATES:
        canvas.text(words[open_[name]], at, size, colour if open_[name] else c.MUTED, align)
