"""The solid parts of the section: coil, core, armature, seats, springs and piston."""

from collections.abc import Sequence

from epv_env.render import geometry as g
from epv_env.render.canvas import Canvas, Point
from epv_env.render.gas import AMBIENT_BAR
from epv_env.render.palette import (
    BODY,
    CARD,
    COIL_COLD,
    COIL_HOT,
    INK,
    IRON,
    MUTED,
    OUTLINE,
    RUBBER,
    STEEL,
    STEEL_SHADE,
    WIRE_COLD,
    WIRE_HOT,
    Colour,
    mix,
    pressure_colour,
)
from epv_env.render.snapshot import Snapshot

FULL_GLOW_A = 0.45
"""Coil current at which the coil is drawn brightest [A]."""

Profile = Sequence[tuple[float, float]]
"""Half widths and heights along the outline of a part that turns around an axis [px]."""


def draw_coil(canvas: Canvas, s: Snapshot) -> None:
    """The windings glow with the current; a bright rim says that the coil is commanded on."""
    glow = abs(s.I_A) / FULL_GLOW_A
    copper, wire = mix(COIL_COLD, COIL_HOT, glow), mix(WIRE_COLD, WIRE_HOT, glow)
    for side in (-1, 1):
        left, right = sorted((g.MV + side * (g.TUBE + 8), g.MV + side * (g.TUBE + 52)))
        box = (left, g.COIL_TOP, right, g.COIL_BOTTOM)
        if s.coil_on:
            rim = (left - 5, g.COIL_TOP - 5, right + 5, g.COIL_BOTTOM + 5)
            canvas.rectangle(rim, COIL_HOT, radius=6)
        canvas.rectangle(box, copper, radius=3)
        for row in range(8):
            for column in (10, 22, 34):
                canvas.circle((left + column, g.COIL_TOP + 9 + 15.4 * row), 4.6, wire)
        canvas.rectangle(box, OUTLINE, radius=3, outline=1.5)


def draw_magnet_valve(canvas: Canvas, m: g.Movers) -> None:
    """Core with the exhaust seat, inlet nozzle, spring, armature."""
    tip, floor = g.CORE_TIP, g.MV_CHAMBER[3] + 1
    _spring(canvas, (g.MV, tip - 8, m.armature_top + g.NOSE_LENGTH), 19.0, coils=4, width=3.0)
    bore = (g.MV - g.BORE, tip - 9, g.MV + g.BORE, tip)
    canvas.rectangle(bore, pressure_colour(AMBIENT_BAR))
    core = [(g.BORE, 172), (g.TUBE, 172), (g.TUBE, tip - 9), (12, tip - 9)]
    _halves(canvas, g.MV, [*core, (g.BORE + 3, tip), (g.BORE, tip)], IRON)
    nozzle = [(g.BORE, floor), (26, floor), (g.BORE + 4, g.INLET_TIP), (g.BORE, g.INLET_TIP)]
    _halves(canvas, g.MV, nozzle, IRON)
    _draw_armature(canvas, m)


def _draw_armature(canvas: Canvas, m: g.Movers) -> None:
    x, top, bottom = g.MV, m.armature_top, m.armature_bottom
    shoulder = top + g.NOSE_LENGTH
    profile = [(g.NOSE, top), (g.NOSE, shoulder), (g.ARMATURE, shoulder), (g.ARMATURE, bottom)]
    _whole(canvas, x, profile, STEEL)
    canvas.rectangle((x - g.ARMATURE + 4, shoulder + 4, x - g.ARMATURE + 9, bottom - 4), CARD)
    canvas.rectangle((x - 9, top, x + 9, top + 5), RUBBER)
    canvas.rectangle((x - 13, bottom - 6, x + 13, bottom), RUBBER)


def draw_protection_valve(canvas: Canvas, m: g.Movers) -> None:
    """Spring, the stop within it, seat and piston."""
    _spring(canvas, (g.PV, g.CEILING, m.piston_top), 46.0, coils=5, width=5.0)
    stop = g.SEAT - g.STROKE_PV - g.PISTON_LENGTH - g.BOSS_LENGTH
    _whole(canvas, g.PV, [(16, g.CEILING - 1), (16, stop)], BODY)
    foot = [(g.SEAT_INNER, g.FLOOR + 1), (g.SEAT_OUTER, g.FLOOR + 1), (g.SEAT_OUTER, g.SEAT + 22)]
    _halves(canvas, g.PV, [*foot, (g.LIP, g.SEAT), (g.SEAT_INNER, g.SEAT)], BODY)
    _draw_piston(canvas, m)


def _draw_piston(canvas: Canvas, m: g.Movers) -> None:
    x, top, bottom = g.PV, m.piston_top, m.piston_bottom
    _whole(canvas, x, [(16, top - g.BOSS_LENGTH), (16, top + 1)], STEEL_SHADE)
    _whole(canvas, x, [(g.PISTON, top), (g.PISTON, bottom)], STEEL)
    canvas.rectangle((x - g.PISTON + 1, bottom - 18, x + g.PISTON - 1, bottom - 1), STEEL_SHADE)
    canvas.rectangle((x - g.SEAT_OUTER, bottom - 8, x + g.SEAT_OUTER, bottom), RUBBER)
    for side in (-1.0, 1.0):
        canvas.circle((x + side * (g.PISTON - 4), top + 26), 5.0, RUBBER)
    canvas.text("PV piston", (x, top + 26), 19, INK, align=0.5)


def _whole(canvas: Canvas, x: float, profile: Profile, colour: Colour) -> None:
    """A solid part, cut along its axis at x."""
    right: list[Point] = [(x + half, y) for half, y in profile]
    left: list[Point] = [(x - half, y) for half, y in reversed(profile)]
    canvas.polygon(right + left, colour, OUTLINE)


def _halves(canvas: Canvas, x: float, profile: Profile, colour: Colour) -> None:
    """A hollow part, cut along its axis at x: what is seen left and right of the bore."""
    for side in (-1.0, 1.0):
        canvas.polygon([(x + side * half, y) for half, y in profile], colour, OUTLINE)


def _spring(
    canvas: Canvas, place: tuple[float, float, float], half: float, *, coils: int, width: float
) -> None:
    """A coil spring, place: axis, top, bottom; first the wires behind, then those in front."""
    x, top, bottom = place
    pitch = (bottom - top - width) / coils
    heights = [top + width / 2 + pitch * k for k in range(coils)]
    for y in heights:
        canvas.stroke([(x + half, y + pitch / 2), (x - half, y + pitch)], MUTED, width)
    for y in heights:
        front = [(x - half, y), (x + half, y + pitch / 2)]
        canvas.stroke(front, OUTLINE, width + 1.5)
        canvas.stroke(front, STEEL, width - 1.0)
