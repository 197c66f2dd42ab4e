"""The gas in the section: chambers filled by pressure, arrows where it flows."""

from typing import NamedTuple

from epv_env.render import geometry as g
from epv_env.render.canvas import Box, Canvas, Point
from epv_env.render.palette import CARD, INK, OUTLINE, Colour, mix, pressure_colour
from epv_env.render.snapshot import Snapshot

AMBIENT_BAR = 1.0
"""Ambient pressure [bar absolute]."""
CHOKED = 0.47
"""Pressure drop over upstream pressure from which the flow no longer grows [-]."""
WIDEST_G_PER_S = 5.0
"""Consumption from which its arrow no longer grows [g/s]."""
LEAST = 0.04
"""Strength of flow below which no arrow is drawn [-]."""


class Flows(NamedTuple):
    """How strongly each passage flows, -1..1; positive in the direction of its name."""

    input_to_output: float
    """Through the seat of the PV."""
    input_to_control: float
    """Through the inlet of the MV."""
    control_to_ambient: float
    """Through the exhaust of the MV."""


def strength(opening: float, upstream_bar: float, downstream_bar: float) -> float:
    """Flow through a passage as a share of the most it can pass; negative when reversed."""
    drop = upstream_bar - downstream_bar
    high = max(upstream_bar, downstream_bar, 1e-9)
    size = min(max(opening, 0.0), 1.0) * min(1.0, abs(drop) / (CHOKED * high)) ** 0.5
    return size if drop >= 0.0 else -size


def flows(s: Snapshot) -> Flows:
    """Flows of a snapshot, for the arrows only: the plant computes the true ones."""
    return Flows(
        input_to_output=strength(s.xPV_fraction, s.p1_bar, s.p2_bar),
        input_to_control=strength(s.xMV_fraction, s.p1_bar, s.p3_bar),
        control_to_ambient=strength(1.0 - s.xMV_fraction, s.p3_bar, AMBIENT_BAR),
    )


def chambers(s: Snapshot, m: g.Movers) -> list[tuple[Box, float]]:
    """Every box of gas and its pressure [bar absolute]; later ones lie on earlier ones."""
    left, right = g.PV - g.PISTON, g.PV + g.PISTON
    control = [
        g.MV_CHAMBER,
        (g.MV - g.TUBE, g.CORE_TIP - 8, g.MV + g.TUBE, g.MV_CHAMBER[1] + 1),
        *g.DUCT,
    ]
    control.append((left, g.CEILING, right, m.piston_top))
    riser = (g.MV - g.BORE, g.INLET_TIP, g.MV + g.BORE, g.INPUT[1] + 1)
    supply = [g.INPUT, g.NECK, (left, m.piston_bottom, right, g.FLOOR)]
    bore = (g.PV - g.SEAT_INNER, m.piston_bottom, g.PV + g.SEAT_INNER, g.OUTPUT[1] + 1)
    exhaust = (g.MV - g.BORE, g.BLOCK[1], g.MV + g.BORE, g.CORE_TIP)
    return (
        [(box, s.p1_bar) for box in supply]
        + [(box, s.p2_bar) for box in (g.OUTPUT, bore)]
        + [(box, s.p3_bar) for box in control]
        + [(riser, s.p1_bar), (exhaust, AMBIENT_BAR)]
    )


def draw_gas(canvas: Canvas, s: Snapshot, m: g.Movers) -> None:
    """Fill the chambers; one rim around all that are joined."""
    boxes = chambers(s, m)
    for (left, top, right, bottom), _ in boxes:
        canvas.rectangle((left - 1.5, top - 1.5, right + 1.5, bottom + 1.5), OUTLINE)
    for box, p_bar in boxes:
        canvas.rectangle(box, pressure_colour(p_bar))
    _open_ports(canvas)
    _draw_throat(canvas, s, m)


def _open_ports(canvas: Canvas) -> None:
    """Take the rim away where the chambers lead out of the body."""
    left, top, right, _ = g.BLOCK
    canvas.rectangle((left - 2, g.INPUT[1] - 2, left, g.INPUT[3] + 2), CARD)
    canvas.rectangle((right, g.OUTPUT[1] - 2, right + 2, g.OUTPUT[3] + 2), CARD)
    canvas.rectangle((g.MV - g.BORE - 2, top - 2, g.MV + g.BORE + 2, top), CARD)


def _draw_throat(canvas: Canvas, s: Snapshot, m: g.Movers) -> None:
    """Over the open seat's lip the pressure falls from p1 to p2."""
    if m.piston_bottom >= g.SEAT:
        return
    high, low = pressure_colour(s.p1_bar), pressure_colour(s.p2_bar)
    outer, steps = g.SEAT_OUTER + 4.0, 12
    for k in range(steps):
        half = outer + (g.SEAT_INNER - 12.0 - outer) * k / steps
        colour = mix(high, low, (k + 1) / steps)
        canvas.rectangle((g.PV - half, m.piston_bottom, g.PV + half, g.SEAT), colour)


def draw_flows(canvas: Canvas, s: Snapshot, m: g.Movers) -> None:
    """Arrows through every open passage across which there is a pressure drop."""
    f = flows(s)
    gap = (m.piston_bottom + g.SEAT) / 2
    for side in (-1.0, 1.0):
        width = 2.0 + 6.0 * abs(f.input_to_output)
        _arrow(canvas, _over_the_seat(side, gap), f.input_to_output, width)
    _arrow(canvas, [(g.MV, 446), (g.MV, 364)], f.input_to_control, 4.0)
    into_control = f.input_to_control - f.control_to_ambient
    _arrow(canvas, [(299, 352), (299, 226)], into_control, 4.0)
    _draw_port_flows(canvas, s, f)


def _draw_port_flows(canvas: Canvas, s: Snapshot, f: Flows) -> None:
    """Arrows outside the body, in the colour of the gas."""
    exhaust = [(g.MV, g.BLOCK[1] - 3), (g.MV, 112.0)]
    _arrow(canvas, exhaust, f.control_to_ambient, 7.0, pressure_colour(s.p3_bar))
    entering = f.input_to_output + 0.15 * f.input_to_control
    _arrow(canvas, [(32, 512), (90, 512)], entering, 9.0, pressure_colour(s.p1_bar))
    if s.sigma_S_g_per_s > 0.0:
        width = 5.0 + 5.0 * min(1.0, s.sigma_S_g_per_s / WIDEST_G_PER_S)
        _arrow(canvas, [(597, 556), (652, 556)], 1.0, width, pressure_colour(s.p2_bar))


def _over_the_seat(side: float, gap: float) -> list[Point]:
    """Path from the ring chamber over the lip into the seat's bore, as a rounded corner."""
    x0, x1 = g.PV + side * 77.0, g.PV + side * 30.0
    start, end = (x0, g.FLOOR - 12.0), (x1, g.SEAT + 78.0)
    arch = [_bend((x0, g.SEAT + 6.0), (x0, gap), ((x0 + x1) / 2, gap), k / 5) for k in range(6)]
    down = [_bend(((x0 + x1) / 2, gap), (x1, gap), (x1, g.SEAT + 12.0), k / 5) for k in range(1, 6)]
    return [start, *arch, *down, end]


def _bend(a: Point, b: Point, c: Point, share: float) -> Point:
    """Point of the curve that leaves a towards b and reaches c from b."""
    u, v, w = (1 - share) ** 2, 2 * share * (1 - share), share**2
    return u * a[0] + v * b[0] + w * c[0], u * a[1] + v * b[1] + w * c[1]


def _arrow(
    canvas: Canvas, points: list[Point], signed: float, width: float, colour: Colour = CARD
) -> None:
    if abs(signed) >= LEAST:
        canvas.arrow(points if signed > 0 else points[::-1], colour, width, INK)
