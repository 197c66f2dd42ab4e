"""Compiled, batched, event-exact integration of the valve.

Sixteen valves ("lanes") go through one loop as SIMD registers, each with a clock and a step of its own
(stepping.py). A lane that has finished goes on at once with its next period or another valve, and none
waits for another.

Every valve, alone or in a batch of thousands, runs through the same instructions in a block of
sixteen; so its trajectory does not depend, to the bit, on its companions or on the number of threads.
"""

import numba
import numpy as np

from epv_env.plant.effects.registry import FEW_LAWS
from epv_env.plant.lanes import (
    COEFFICIENT,
    EFFECT,
    EVENT,
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
    new_workspace,
    state_at,
)
from epv_env.plant.primitives import FLAGS, inlined, source_digest, wide_vectors
from epv_env.plant.stepping import UNLIMITED, locate_event, try_steps

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
            if extended is not None:
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


@inlined
def _run(state, coefficients, effects, inputs, duration, lowest, highest, record, step, first, last,
         extended):  # fmt: skip
    """Body of the KERNELS."""
    wide_vectors()
    work, queue = new_workspace(), new_queue(first, last)
    work[REMAINING] = work[EVENT] = 0.0
    busy = True
    while busy:
        busy = False
        for lane in range(LANES):
            if work[EVENT, lane] != 0.0:
                locate_event(work, lane)
            if work[REMAINING, lane] <= 0.0 or queue[STEPS, lane] >= MAX_STEPS:
                go_on(work, lane, queue, state, coefficients, effects, inputs, duration, lowest, highest,
                      record, extended)  # fmt: skip
            queue[STEPS, lane] += 1
            busy |= queue[VALVE, lane] != NONE
        try_steps(work, step, extended)


# Closed over by the kernels: a change of any inlined source changes their key in the disk cache.
_DIGEST = source_digest()


def _compile(extended, digest):
    @numba.njit(cache=True, nogil=True, **FLAGS)
    def run(state, coefficients, effects, inputs, duration, lowest, highest, record, step, first,
            last):  # fmt: skip
        if digest == "":  # keeps the digest in the closure
            return
        wide_vectors()
        _run(state, coefficients, effects, inputs, duration, lowest, highest, record, step, first,
             last, extended)  # fmt: skip

    return run


FORMS = (None, FEW_LAWS, True)
"""`extended` of `derivative`, by the kernel's number (`registry.kernel_of`)."""

KERNELS = tuple(_compile(form, _DIGEST) for form in FORMS)
"""Without effects; with all effects of effects/; with more laws of theirs, too. `run_nominal` has the
arguments of each, which is compiled when it is first called."""

run_nominal = KERNELS[0]
"""Advance lanes first..last of a batch through one or more periods, in place.

state [N_STATE, lanes], coefficients, effects; inputs [period, N_INPUT, lanes]; duration [period, lanes]
in s; lowest, highest [lanes]: running extremes of p2 in Pa; record [period, N_STATE, lanes] takes the
state after each period, or nothing if it is empty; step: largest step [s]. All C-contiguous float64,
first and last multiples of LANES. A lane that cannot be integrated becomes NaN.
"""
