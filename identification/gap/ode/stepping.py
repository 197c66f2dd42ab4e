"""One step of the classical Runge-Kutta method that stops at thresholds.

The functions are written once, for numbers, for arrays of candidates, and for numba.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.gap.ode.settings import OdeSettings


class Steps(NamedTuple):
    """Functions that advance a plant; arrays are (states,), or (states, candidates) for `runge_kutta`."""

    runge_kutta: Callable[..., tuple[NDArray, NDArray]]
    """(x, t, h, u, p, push): the state after h [s], and the thresholds at the stages."""
    levels: Callable[..., NDArray]
    """(x, t, u, p): the threshold functions; a change of sign marks a threshold."""
    advance: Callable[..., NDArray]
    """(x, t, h, u, p, push): the state (states,) after h [s], with stops at thresholds."""


def stepping(
    rate: Callable, thresholds: Callable, count: int, settings: OdeSettings, wrap: Callable
) -> Steps:
    """Functions that advance a plant.

    Args:
        rate: derivatives of the states, as `Records.flat` makes it.
        thresholds: functions whose change of sign marks a threshold, likewise.
        count: number of thresholds.
        settings: accuracy.
        wrap: compiles a function, or leaves it as it is.
    """
    factor, shortest, most = settings.approach_factor, settings.shortest_step, settings.most_event_steps

    @wrap
    def derivative(x, t, u, p, push):
        return rate(x, t, u, p, np.empty_like(x)) + push

    @wrap
    def levels(x, t, u, p):
        return thresholds(x, t, u, p, np.empty((count,) + x.shape[1:]))

    @wrap
    def runge_kutta(x, t, h, u, p, push):
        stages = np.zeros((4, count) + x.shape[1:])
        k1 = derivative(x, t, u, p, push)
        x2 = x + 0.5 * h * k1
        k2 = derivative(x2, t + 0.5 * h, u, p, push)
        x3 = x + 0.5 * h * k2
        k3 = derivative(x3, t + 0.5 * h, u, p, push)
        x4 = x + h * k3
        end = x + (h / 6.0) * (k1 + 2.0 * k2 + 2.0 * k3 + derivative(x4, t + h, u, p, push))
        if count > 0:
            stages[0] = levels(x2, t + 0.5 * h, u, p)
            stages[1] = levels(x3, t + 0.5 * h, u, p)
            stages[2] = levels(x4, t + h, u, p)
            stages[3] = levels(end, t + h, u, p)
        return end, stages

    @wrap
    def passes(before, stages):
        for stage in stages:
            for i in range(count):
                if before[i] * stage[i] < 0.0:
                    return True
        return False

    @wrap
    def held(x, slope, after, after_slope, before_level, t, tiny, left, u, p):
        """Slide along a threshold where both sides push towards it (Filippov); else the state after."""
        level = levels(after, t, u, p)
        beyond = levels(after + tiny * after_slope, t, u, p)
        for i in range(count):
            if before_level[i] * level[i] < 0.0 and level[i] * beyond[i] < 0.0:
                towards, back = level[i] - before_level[i], beyond[i] - level[i]
                share = towards / (towards - back)
                return x + left * (slope + share * (after_slope - slope)), True
        return after, False

    @wrap
    def advance(x, t, h, u, p, push):
        tiny, left, size = shortest * h, h, h
        before = levels(x, t, u, p)
        if np.any(before == 0.0):
            # On a threshold the sign is open: the rate decides to which side the state leaves it.
            x = x + tiny * derivative(x, t, u, p, push)
            before = levels(x, t, u, p)
        for _ in range(most):
            size = min(size, left)
            end, stages = runge_kutta(x, t, size, u, p, push)
            if not passes(before, stages):
                # No stage has seen the rate beyond the threshold: the step keeps its order.
                x, t, left = end, t + size, left - size
                before = stages[3].copy()
            elif size > tiny:
                size = max(size / factor, tiny)
                continue
            else:
                slope = derivative(x, t, u, p, push)
                after = x + tiny * slope
                after_slope = derivative(after, t, u, p, push)
                x, holds = held(x, slope, after, after_slope, before, t, tiny, left, u, p)
                if holds:
                    return x
                t, left, size = t + tiny, left - tiny, left
                before = levels(x, t, u, p)
            if left <= tiny:
                return x
        return runge_kutta(x, t, left, u, p, push)[0]

    return Steps(runge_kutta, levels, advance)
