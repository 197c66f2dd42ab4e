"""Which valve a lane works on: a lane that has finished goes on at once, and none waits for another."""

import numpy as np

from epv_env.plant.lanes import (
    COEFFICIENT,
    EFFECT,
    HIGHEST,
    HINT,
    INPUT,
    LANES,
    LOCATED,
    LOWEST,
    N_COEFFICIENT,
    N_EFFECT,
    N_INPUT,
    N_STATE,
    REMAINING,
    STATE,
    copy_column,
    state_at,
)
from epv_env.plant.primitives.compiled import inlined
from epv_env.plant.stepping import UNLIMITED

MAX_STEPS = 200_000
"""Steps per period after which a valve is given up (its state becomes NaN)."""

NONE = -1
"""Instead of a valve: the lane has nothing left to do."""

VALVE = 0
"""Row of the lanes' valves in a queue, an array of integers (rows, LANES)."""
PERIOD = 1
"""Row of the periods that they are in."""
STEPS = 2
"""Row of the steps that they have taken in these periods."""
WAITING = 3
"""Row of the next valve and of the end of the valves."""


@inlined
def new_queue(first, last):
    """A queue of the valves first .. last - 1, with all lanes free."""
    queue = np.zeros((4, LANES), np.int64)
    queue[VALVE] = NONE
    queue[WAITING, 0], queue[WAITING, 1] = first, last
    return queue


# The arrays are arguments, one by one: out of a tuple, each use would count references, atomically.
@inlined
def go_on(work, lane, queue, state, coefficients, effects, inputs, duration, lowest, highest, record,
          extended):  # fmt: skip
    """Let a lane without time left begin its valve's next period, or the first one of another valve.

    Arguments as of `run_nominal`. A valve that took MAX_STEPS in its period is given up.
    """
    periods = inputs.shape[0]
    while True:
        valve = queue[VALVE, lane]
        if valve != NONE:
            if queue[STEPS, lane] >= MAX_STEPS:
                for row in range(N_STATE):
                    work[STATE + row, lane] = np.nan
            if record.shape[0] > 0:
                for row in range(N_STATE):
                    record[queue[PERIOD, lane], row, valve] = work[STATE + row, lane]
            queue[PERIOD, lane] += 1
            if queue[PERIOD, lane] == periods:
                copy_column(work, STATE, lane, state, 0, valve, N_STATE)
                lowest[valve], highest[valve] = work[LOWEST, lane], work[HIGHEST, lane]
        if valve == NONE or queue[PERIOD, lane] == periods:
            valve = queue[WAITING, 0]
            if valve == queue[WAITING, 1]:
                queue[VALVE, lane] = NONE
                work[REMAINING, lane] = 0.0
                break
            queue[WAITING, 0] += 1
            queue[VALVE, lane], queue[PERIOD, lane], queue[STEPS, lane] = valve, 0, 0
            copy_column(state, 0, valve, work, STATE, lane, N_STATE)
            copy_column(coefficients, 0, valve, work, COEFFICIENT, lane, N_COEFFICIENT)
            if extended:
                copy_column(effects, 0, valve, work, EFFECT, lane, N_EFFECT)
            p2 = state_at(work, STATE, lane).p2
            work[LOWEST, lane] = min(lowest[valve], p2)
            work[HIGHEST, lane] = max(highest[valve], p2)
        if queue[STEPS, lane] < MAX_STEPS:  # else the valve has been given up
            queue[STEPS, lane] = 0
            for row in range(N_INPUT):
                work[INPUT + row, lane] = inputs[queue[PERIOD, lane], row, valve]
            work[REMAINING, lane] = duration[queue[PERIOD, lane], valve]
            work[HINT, lane], work[LOCATED, lane] = UNLIMITED, 0.0
            if work[REMAINING, lane] > 0.0:
                break
