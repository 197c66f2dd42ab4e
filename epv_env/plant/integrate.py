"""Compiled, batched, event-exact integration of the valve.

Sixteen valves ("lanes") go through one loop as SIMD registers, each with a clock and a step of its own
(stepping.py). A lane that has finished goes on with its next period or another valve (schedule.py).

Every valve, alone or in a batch of thousands, runs through the same instructions in a block of
sixteen; so its trajectory does not depend, to the bit, on its companions or on the number of threads.
"""

import numba

from epv_env.plant.lanes import EVENT, LANES, REMAINING, new_workspace
from epv_env.plant.primitives.compiled import FLAGS, inlined, source_digest, wide_vectors
from epv_env.plant.schedule import MAX_STEPS, NONE, STEPS, VALVE, go_on, new_queue
from epv_env.plant.step_control import DEFAULT_STEP as DEFAULT_STEP
from epv_env.plant.stepping import locate_event, try_steps


@inlined
def _run(state, coefficients, effects, inputs, duration, lowest, highest, record, step, first, last,
         extended):  # fmt: skip
    """Body of `run_nominal` and `run_extended`."""
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


run_nominal = _compile(False, _DIGEST)
"""Advance lanes first..last of a batch through one or more periods, in place.

state [N_STATE, lanes], coefficients, effects; inputs [period, N_INPUT, lanes]; duration [period, lanes]
in s; lowest, highest [lanes]: running extremes of p2 in Pa; record [period, N_STATE, lanes] takes the
state after each period, or nothing if it is empty; step: largest step [s]. All C-contiguous float64,
first and last multiples of LANES. A lane that cannot be integrated becomes NaN.
"""

run_extended = _compile(True, _DIGEST)
"""`run_nominal` with every effect of effects.py compiled in."""
