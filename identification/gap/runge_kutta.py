"""Steps of the classical Runge-Kutta method, with stops at thresholds.

A step counts only where no stage of it lies beyond a threshold, so that its order is kept. Otherwise it
is shortened until the threshold is near enough to be passed in one tiny step. A state that both sides of
a threshold push back slides along it, to first order, and exactly where it sticks.
"""

from collections.abc import Callable

import numpy as np
from numba.extending import register_jitable

_registered = register_jitable(error_model="numpy", no_cfunc_wrapper=True)

SHORTEST_STEP = 1e-8
"""Sub-step at which a threshold is passed, relative to the ordinary sub-step [1]: a threshold is located
to this accuracy, well above rounding."""


def compiled(function: Callable) -> Callable:
    """The function, which compiled ones may call, too; divisions by zero then give inf, as in numpy."""
    return function if hasattr(function, "py_func") else _registered(function)


@compiled
def copy(source, target):
    """Copy (n,) numbers. numba compiles `target[:] = source` with sentences for shapes that differ."""
    for i in range(len(target)):
        target[i] = source[i]


def advancing(rate: Callable, thresholds: Callable, count: int) -> Callable:
    """A function (x, t, h, u, p, push, work) that advances one candidate's states x (states,) by h [s].

    push: forcing of the rates, (states,). work: scratch, (6, states):
    four slopes, a stage and the end.

    Args:
        rate: derivatives of the states, as `Records.flat` makes it.
        thresholds: functions whose change of sign marks a threshold, likewise.
        count: number of thresholds.
    """

    @compiled
    def slope(x, t, u, p, push, out):
        rate(x, t, u, p, out)
        for i in range(len(x)):
            out[i] += push[i]

    @compiled
    def passed(x, t, u, p, before, level):
        """Index of a threshold that lies between x and where `before` was taken; -1 for none."""
        if count > 0:
            thresholds(x, t, u, p, level)
            for i in range(count):
                if before[i] * level[i] < 0.0:
                    return i
        return -1

    @compiled
    def try_step(x, t, h, u, p, push, before, level, work):
        """A step into work[5]; returns whether no stage has passed a threshold."""
        slope(x, t, u, p, push, work[0])
        for stage in range(1, 4):
            part = h if stage == 3 else 0.5 * h
            for i in range(len(x)):
                work[4, i] = x[i] + part * work[stage - 1, i]
            if passed(work[4], t + part, u, p, before, level) >= 0:
                return False
            slope(work[4], t + part, u, p, push, work[stage])
        for i in range(len(x)):
            inner = work[0, i] + 2.0 * work[1, i] + 2.0 * work[2, i] + work[3, i]
            work[5, i] = x[i] + h / 6.0 * inner
        return passed(work[5], t + h, u, p, before, level) < 0

    @compiled
    def pass_threshold(x, t, tiny, left, u, p, push, before, level, work):
        """Pass a threshold by a tiny step, or stay on it where both sides push back (Filippov)."""
        slope(x, t, u, p, push, work[0])
        work[4] = x + tiny * work[0]
        i = passed(work[4], t, u, p, before, level)
        if i >= 0:
            old, new = before[i], level[i]
            slope(work[4], t, u, p, push, work[1])
            work[5] = work[4] + tiny * work[1]
            thresholds(work[5], t, u, p, level)
            if new * level[i] < 0.0:
                share = (new - old) / ((new - old) - (level[i] - new))
                x += left * (work[0] + share * (work[1] - work[0]))
                return True
        copy(work[4], x)
        return False

    @compiled
    def advance_past_thresholds(x, t, h, u, p, push, work):
        tiny, left, size = SHORTEST_STEP * h, h, h
        before, level = np.empty(count), np.empty(count)
        thresholds(x, t, u, p, before)
        if np.any(before == 0.0):
            # On a threshold the sign is open: the rate decides to which side the state leaves it.
            slope(x, t, u, p, push, work[0])
            x += tiny * work[0]
            thresholds(x, t, u, p, before)
        for _ in range(600):  # in which ten crossings find room
            size = min(size, left)
            if try_step(x, t, size, u, p, push, before, level, work):
                copy(work[5], x)
                t, left = t + size, left - size
            elif size > tiny:
                size = max(size / 8.0, tiny)
                continue
            elif pass_threshold(x, t, tiny, left, u, p, push, before, level, work):
                return
            else:
                t, left = t + tiny, left - tiny
                size = left
            if left <= tiny:
                return
            thresholds(x, t, u, p, before)

    @compiled
    def advance(x, t, h, u, p, push, work):
        if count > 0:
            advance_past_thresholds(x, t, h, u, p, push, work)
        else:
            try_step(x, t, h, u, p, push, push, push, work)
            copy(work[5], x)

    return advance
