"""One classical Runge-Kutta step of the whole state, and how long the steps are.

Movers that a stop holds are kept still. The length of the first step comes from the rates, that of
later ones from an estimate of the error: the difference between the Runge-Kutta step and the midpoint
rule, which costs nothing. That difference is of third order. Times (h/TIME_SCALE)^2 it is of the fifth,
as the error is.
"""

from epv_env.plant.equations import State, derivative
from epv_env.plant.lanes import moved
from epv_env.plant.primitives import generated, inlined, replacing

_with_motion = replacing(State, "xPV", "vPV", "xMV", "vMV")


@inlined
def is_held(x, v, x_max, force):
    """Whether a stop holds a mover: at rest on it and pressed against it."""
    at_low = (x <= 0.0) & (force <= 0.0)
    at_high = (x >= x_max) & (force >= 0.0)
    return (v == 0.0) & (at_low | at_high)


@inlined
def held_still(rates, free_PV, free_MV):
    """The rates with those of held movers set to zero."""
    return _with_motion(
        rates,
        rates.xPV * free_PV, rates.vPV * free_PV,
        rates.xMV * free_MV, rates.vMV * free_MV,
    )  # fmt: skip


midpoint_difference = generated(
    "midpoint_difference",
    "k1, k2, k3, k4, sixth",
    "return State(" + ", ".join(
        f"sixth * (k1.{f} - 4.0 * k2.{f} + 2.0 * k3.{f} + k4.{f})" for f in State._fields
    ) + ")",
    State=State,
)  # fmt: skip
"""The state after the step less that after a step of the midpoint rule; it falls with the step cubed."""


@inlined
def remaining_stages(q, k1, u, c, effects, free_PV, free_MV, h, extended):
    """Stages 2 to 4 and their sum.

    k1: rates at q. Returns the state after h [s]; each mover's force in mid-step and at the end, which
    tell whether and when a stop lets go; and the difference between the state and that of the midpoint
    rule, a State.
    """
    k2, _, _ = derivative(moved(q, k1, 0.5 * h), u, c, effects, free_PV, free_MV, extended)
    k3, mid_PV, mid_MV = derivative(moved(q, k2, 0.5 * h), u, c, effects, free_PV, free_MV, extended)
    k4, end_PV, end_MV = derivative(moved(q, k3, h), u, c, effects, free_PV, free_MV, extended)
    sixth, third = h / 6.0, h / 3.0
    end = moved(moved(moved(moved(q, k1, sixth), k2, third), k3, third), k4, sixth)
    return end, (mid_PV, mid_MV, end_PV, end_MV), midpoint_difference(k1, k2, k3, k4, sixth)


DEFAULT_STEP = 200e-6
"""Largest step while a piston or armature moves, and a step that is always good enough [s]."""

LONGEST = 12.5
"""Longest step while both movers are held, over the largest while one moves: half a control period."""

TIME_SCALE = 0.005
"""Time by which the difference to the midpoint rule is brought to the order of the error [s]."""

FASTEST_RATE = 400.0
"""Rate with which current and control pressure decay while both movers are held [1/s]."""

PRESSURE_TOLERANCE = 1.0
"""Error of a pressure that a step may make [Pa]; a hundredth of a millibar."""

CURRENT_TOLERANCE = 4e-6
"""Error of the current that a step may make [A]."""

MUCH = 30.0
"""Error over its tolerance beyond which a step is shortened to a third rather than to two thirds."""

LITTLE = 0.1
"""Error over its tolerance below which the next step is half as long again."""


@inlined
def first_step(rates, step, longest):
    """Step to try after a change of the inputs [s]: as if rates decayed with FASTEST_RATE.

    rates: State of rates. step: the step that is always good enough; longest: that may be tried [s].
    """
    motion = max(abs(rates.p3) * (1.0 / PRESSURE_TOLERANCE), abs(rates.I) * (1.0 / CURRENT_TOLERANCE))
    h = longest
    for _ in range(3):
        decay = h * FASTEST_RATE
        error = motion * h * decay * decay * decay * decay * (1.0 / 120.0)
        h = max(0.6 * h, step) if error > _strictness(step) else h
    return h


@inlined
def _strictness(step):
    """Factor of the tolerances: they fall with `step` as the error of a step of this length does."""
    relative = step * (1.0 / DEFAULT_STEP)
    return relative * relative * relative * relative * relative


@inlined
def relative_error(difference, h, step, extended):
    """Estimated error of a step over its tolerance [-]; difference: State, to the midpoint rule."""
    d = difference
    pressure = max(abs(d.p2), abs(d.p3))
    if extended is not None:
        sensors = max(abs(d.lag_2), abs(d.lag_3))
        pressure = max(max(pressure, sensors), max(abs(d.far_pressure), abs(d.supply_drop)))
    error = max(pressure * (1.0 / PRESSURE_TOLERANCE), abs(d.I) * (1.0 / CURRENT_TOLERANCE))
    relative = h * (1.0 / TIME_SCALE)
    return error * relative * relative / _strictness(step)


@inlined
def next_step(h, error):
    """Largest next step after one of h [s], refused or not, whose error over its tolerance is known."""
    shortened = 0.35 * h if error > MUCH else 0.65 * h
    lengthened = 1.5 * h if error < LITTLE else h
    return shortened if error > 1.0 else lengthened
