"""Kernels of the environment: what a thread does for its valve.

The functions that they call are those of the CPU (plant/, period.py), compiled as they are.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import cuda, float64, int64

from epv_env.device.random import draw_normals, philox
from epv_env.period import begin_period, end_period, observe
from epv_env.plant.integrate import MAX_STEPS, NONE, STEPS, VALVE, WAITING, go_on
from epv_env.plant.lanes import EVENT, N_COEFFICIENT, N_EFFECT, N_INPUT, N_ROW, N_STATE, REMAINING
from epv_env.plant.primitives import exact
from epv_env.plant.stepping import locate_event, try_step
from epv_env.plant.valves import U_ROW, acting
from epv_env.result import FAILED, REWARD

THREADS = 128
"""Threads of a block."""

NOISE, EPISODE = 0, 1
"""Last part of a counter: what is drawn."""


class Batch(NamedTuple):
    """All that the future of n valves depends on, arrays as in `LimitingTask.memory`."""

    episodes: Any
    progress: Any
    state: Any
    coefficients: Any
    effects: Any
    sensors: Any
    with_effects: Any
    delay: Any
    acting_U: Any
    delay_left: Any


class Results(NamedTuple):
    """What a step gives, and its working memory."""

    observation: Any
    """(n, entries) float32 [-]."""
    final_observation: Any
    """The same before the episodes that ended began anew."""
    reward: Any
    """(n,) [-]; NaN after an action outside the action space."""
    terminated: Any
    """(n,) bool."""
    truncated: Any
    """(n,) bool."""
    ended: Any
    """(n,) bool: either."""
    begun: Any
    """(n,) bool: began anew in this step instead of taking it."""
    started: Any
    """Episodes begun so far, (n,)."""
    figures: Any
    """(N_FIGURE, n) [SI, bar], rows of result.py."""
    noise: Any
    """(n, 1, 4) [-]."""
    before: Any
    """State before the period, (N_STATE, n)."""
    inputs: Any
    """(4, N_INPUT, n): each part of the period, while the former voltage acts and afterwards."""
    duration: Any
    """(4, n) [s]."""
    lowest: Any
    """(n,) [Pa]."""
    highest: Any
    """(n,) [Pa]."""
    on_time: Any
    """(n,) [s]."""
    action: Any
    """(n,) [-]."""


@exact
def delayed_parts(inputs, duration, b, i):
    """Split both parts of the period where the coil's delay ends; returns how many parts there are.

    inputs (4, N_INPUT, n), duration (4, n): rows 0 and 1 hold the parts, then all rows.
    """
    if b.delay[i] <= 0.0:
        return 2 if duration[1, i] > 0.0 else 1
    for part in (1, 0):
        for row in range(N_INPUT):
            inputs[2 * part, row, i] = inputs[2 * part + 1, row, i] = inputs[part, row, i]
        duration[2 * part, i] = duration[part, i]
    for first in (0, 2):
        whole, former = duration[first, i], b.acting_U[i]
        before, b.acting_U[i], b.delay_left[i] = acting(
            inputs[first, U_ROW, i], whole, b.delay[i], former, b.delay_left[i]
        )
        if before > 0.0:
            inputs[first, U_ROW, i] = former
        duration[first, i], duration[first + 1, i] = before, whole - before
    return 4


@exact
def begin_episode(b, starts, r, key, i):
    """Begin an episode of valve i: its own start at first, later one that is drawn from all starts."""
    j, count = i % len(starts.episodes), np.uint64(r.started[i])
    if r.started[i] > 0:
        drawn, _, _, _ = philox(key, np.uint64(i), np.uint64(0), count, np.uint64(EPISODE))
        j = np.int64(drawn % np.uint64(len(starts.episodes)))
    b.episodes[i] = starts.episodes[j]
    b.progress[i] = starts.progress[j]
    b.sensors[i] = starts.sensors[j]
    for row in range(N_STATE):
        b.state[row, i] = starts.state[row, j]
    for row in range(N_COEFFICIENT):
        b.coefficients[row, i] = starts.coefficients[row, j]
    for row in range(N_EFFECT):
        b.effects[row, i] = starts.effects[row, j]
    b.with_effects[i], b.delay[i] = starts.with_effects[j], starts.delay[j]
    b.acting_U[i], b.delay_left[i] = math.nan, 0.0
    r.started[i] += 1
    observe(b.episodes[i], r.observation[i])


@cuda.jit
def restart(b, starts, r, key, instead):
    """Begin the ended episodes anew. instead: whether that takes the place of their next step."""
    i = cuda.grid(1)  # type: ignore[call-arg]
    if i >= len(b.episodes):
        return
    r.begun[i] = r.ended[i] and instead
    if r.ended[i]:
        for k in range(r.observation.shape[1]):
            r.final_observation[i, k] = r.observation[i, k]
        begin_episode(b, starts, r, key, i)
    if r.begun[i]:
        r.reward[i] = 0.0
        for row in range(r.figures.shape[0]):
            r.figures[row, i] = 0.0
        r.terminated[i] = r.truncated[i] = r.ended[i] = False


@cache
def step_kernel(rule: Callable[..., Any], with_effects: bool) -> Any:
    """The kernel that takes one control period of all valves with or without effects.

    rule: of one action (actions.py).
    """
    extended = True if with_effects else None

    @cuda.jit
    def step(b, r, rules, actions, slots, key, limits, longest):
        i = cuda.grid(1)  # type: ignore[call-arg]
        if i >= len(b.episodes) or b.with_effects[i] != with_effects or r.begun[i]:
            return
        e = b.episodes[i]
        r.on_time[i], r.action[i], valid = rule(float(actions[i]), rules[0].control_period, slots)
        begin_period(b.episodes, b.progress, rules, b.state, r.before, r.inputs, r.duration, r.lowest,
                     r.highest, r.on_time, r.action, r.figures, i, i + 1)  # fmt: skip
        parts = delayed_parts(r.inputs, r.duration, b, i)
        work, queue = cuda.local.array((N_ROW, 1), float64), cuda.local.array((4, 2), int64)
        queue[VALVE, 0], queue[WAITING, 0], queue[WAITING, 1], queue[STEPS, 0] = NONE, i, i + 1, 0
        work[REMAINING, 0] = work[EVENT, 0] = 0.0
        while True:
            if work[EVENT, 0] != 0.0:
                locate_event(work, 0)
            if work[REMAINING, 0] <= 0.0 or queue[STEPS, 0] >= MAX_STEPS:
                go_on(work, 0, queue, b.state, b.coefficients, b.effects, r.inputs[:parts],
                      r.duration[:parts], r.lowest, r.highest, r.inputs[:0], extended)  # fmt: skip
            if queue[VALVE, 0] == NONE:
                break
            queue[STEPS, 0] += 1
            try_step(work, longest, extended)
        draw_normals(key, i, r.started[i], e.steps + 1, NOISE, e.noise, r.noise[i, 0])
        end_period(b.episodes, rules, r.noise, b.state, r.before, r.lowest, r.highest, b.sensors,
                   r.figures, r.observation, i, i + 1)  # fmt: skip
        r.reward[i] = r.figures[REWARD, i] if valid else math.nan
        r.terminated[i], r.truncated[i] = r.figures[FAILED, i] != 0.0, e.steps >= limits[i]
        r.ended[i] = r.terminated[i] or r.truncated[i]

    return step
