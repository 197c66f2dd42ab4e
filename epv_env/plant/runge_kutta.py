"""One classical Runge-Kutta step of the whole state, with the movers that a stop holds kept still."""

from epv_env.plant.equations import State, derivative
from epv_env.plant.lanes import moved
from epv_env.plant.primitives.compiled import generated, inlined, replacing

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
