"""Kernels of the environment: what a thread does for its valve.

The functions that they call are those of the CPU (plant/, period.py), compiled as they are. They take
tables of many valves; a thread hands them its valve's columns, and working memory of its own.
"""

import math
import warnings
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numba.cuda
import numpy as np
from numba import float32, float64, int64

from epv_env.actions import on_off
from epv_env.device.random import draw_normals, philox
from epv_env.observation import ENTRIES, READINGS, read
from epv_env.period import begin_period, end_period, observe
from epv_env.plant.equations import State
from epv_env.plant.integrate import FORMS, MAX_STEPS, NONE, STEPS, VALVE, WAITING, go_on
from epv_env.plant.lanes import EVENT, N_COEFFICIENT, N_EFFECT, N_INPUT, N_ROW, N_STATE, REMAINING
from epv_env.plant.primitives import exact
from epv_env.plant.runge_kutta import DEFAULT_STEP
from epv_env.plant.stepping import locate_event, try_step
from epv_env.plant.valves import U_ROW, acting
from epv_env.result import FAILED, N_FIGURE, REWARD
from epv_env.signals import OptionError
from epv_env.task import LimitingTask

cuda: Any = numba.cuda  # to a type checker its functions are classes

THREADS = 128
"""Threads of a block."""

NOISE, EPISODE = 0, 1
"""Last part of a counter: what is drawn."""

INSTEAD, AFTER, KEEP = range(3)
"""What becomes of an episode that has ended, in the order of Gymnasium's AutoresetMode: the next one
begins instead of the valve's next step, or after the step that ended it, or it runs on."""

NUMBERS = ("state", "coefficients", "effects", "kernel", "delay", "acting_U", "delay_left")
"""Arrays of `LimitingTask.memory` that are rows of one table here, in their order."""
COEFFICIENTS = N_STATE
EFFECTS = COEFFICIENTS + N_COEFFICIENT
KERNEL = EFFECTS + N_EFFECT
DELAY_ON, DELAY_OFF, ACTING_U, DELAY_LEFT = range(KERNEL + 1, KERNEL + 5)
P2, COIL_ENERGY = (State._fields.index(name) for name in ("p2", "coil_energy"))
"""Rows of the table, the state being the first ones."""


class Batch(NamedTuple):
    """All that the future of n valves depends on; a launch takes the longer the more arrays it has."""

    episodes: Any
    """Records of EPISODE (n,)."""
    progress: Any
    """Records of PROGRESS (n,)."""
    sensors: Any
    """Records of SENSOR_RECORD (n,)."""
    numbers: Any
    """(rows of NUMBERS, n) [SI]."""
    keys: Any
    """Of the random numbers that are drawn on the device, (n,)."""

    @classmethod
    def of(cls, task: LimitingTask) -> "Batch":
        """Of a task on the host: NumPy's arrays. Raises OptionError for what a device cannot follow."""
        if any(task._signals):
            raise OptionError(
                "a device follows no recordings and moving targets: leave them out, or use the CPU"
            )
        m, n = task.memory, task.n
        numbers = np.concatenate([np.atleast_2d(m[name])[:, :n] for name in NUMBERS], dtype=float)
        keys = m["noise"][:, 1, 0].copy().view(np.uint64)  # all zero where there is no noise
        return cls(m["episodes"], m["progress"], m["sensors"][:n], numbers, keys)


class Results(NamedTuple):
    """What a step gives."""

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


def launch(kernel: Any, n: int, *arguments: Any) -> None:
    """Run a kernel in n threads. That few do not fill an accelerator is no news to who asked for few."""
    threads = min(THREADS, n)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*Grid size")
        configured = kernel[-(-n // threads), threads]
    configured(*arguments)


@cuda.jit
def copy_actions(actions, asked):
    """Actions (n,) of any real type and stride as float64: the step is compiled for no other."""
    i = cuda.grid(1)
    if i < len(asked):
        asked[i] = actions[i]


@exact
def alone(b, i):
    """The Batch of valve i alone, which shares the memory."""
    episode, progress, sensors = b.episodes[i : i + 1], b.progress[i : i + 1], b.sensors[i : i + 1]
    return Batch(episode, progress, sensors, b.numbers[:, i : i + 1], b.keys[i : i + 1])


@exact
def delayed_parts(inputs, duration, numbers):
    """Split both parts of a valve's period where the coil's delay ends; returns how many there are.

    inputs (4, N_INPUT, 1), duration (4, 1): rows 0 and 1 hold the parts, then all rows.
    """
    if numbers[DELAY_ON, 0] <= 0.0 and numbers[DELAY_OFF, 0] <= 0.0:
        return 2 if duration[1, 0] > 0.0 else 1
    for part in (1, 0):
        for row in range(N_INPUT):
            inputs[2 * part, row, 0] = inputs[2 * part + 1, row, 0] = inputs[part, row, 0]
        duration[2 * part, 0] = duration[part, 0]
    for first in (0, 2):
        whole, former = duration[first, 0], numbers[ACTING_U, 0]
        before, numbers[ACTING_U, 0], numbers[DELAY_LEFT, 0] = acting(
            inputs[first, U_ROW, 0], whole, numbers[DELAY_ON, 0], numbers[DELAY_OFF, 0], former,
            numbers[DELAY_LEFT, 0],
        )  # fmt: skip
        if before > 0.0:
            inputs[first, U_ROW, 0] = former
        duration[first, 0], duration[first + 1, 0] = before, whole - before
    return 4


@exact
def integrate(numbers, inputs, duration, lowest, highest, work, queue, extended):
    """Advance a valve through the parts of its period. extended: as of `derivative`."""
    state, effects = numbers[:N_STATE], numbers[EFFECTS:KERNEL]
    queue[VALVE, 0], queue[WAITING, 0], queue[WAITING, 1], queue[STEPS, 0] = NONE, 0, 1, 0
    work[REMAINING, 0] = work[EVENT, 0] = 0.0
    while True:
        if work[EVENT, 0] != 0.0:
            locate_event(work, 0)
        if work[REMAINING, 0] <= 0.0 or queue[STEPS, 0] >= MAX_STEPS:
            go_on(work, 0, queue, state, numbers[COEFFICIENTS:EFFECTS], effects, inputs, duration,
                  lowest, highest, inputs[:0], extended)  # fmt: skip
        if queue[VALVE, 0] == NONE:
            break
        queue[STEPS, 0] += 1
        try_step(work, DEFAULT_STEP, extended)


@cache
def one_period(kernel: int) -> Any:
    """The function that takes one control period of a valve (v, a Batch).

    kernel: the greatest number of the valves' kernels (`registry.kernel_of`).
    noise (1, 1, 4) [-]; figures (N_FIGURE, 1) and observation (1, entries) are its results.
    """

    extended = FORMS[kernel]

    @exact
    def take(v, rules, on_time, action, noise, figures, observation):
        before, state = cuda.local.array((N_STATE, 1), float64), v.numbers[:N_STATE]
        inputs, duration = cuda.local.array((4, N_INPUT, 1), float64), cuda.local.array((4, 1), float64)
        lowest, highest = cuda.local.array(1, float64), cuda.local.array(1, float64)
        asked, shown = cuda.local.array(1, float64), cuda.local.array(1, float64)
        work, queue = cuda.local.array((N_ROW, 1), float64), cuda.local.array((4, 2), int64)
        asked[0], shown[0] = on_time, action
        for part in range(2):
            for row in range(N_INPUT):  # no period sets them all
                inputs[part, row, 0] = 0.0
        begin_period(v.episodes, v.progress, rules, state, before, inputs, duration, lowest, highest,
                     asked, shown, figures, 0, 1)  # fmt: skip
        parts = delayed_parts(inputs, duration, v.numbers)
        inputs, duration = inputs[:parts], duration[:parts]
        if kernel > 0 and v.numbers[KERNEL, 0] != 0.0:
            integrate(v.numbers, inputs, duration, lowest, highest, work, queue, extended)
        else:
            integrate(v.numbers, inputs, duration, lowest, highest, work, queue, None)
        end_period(v.episodes, rules, noise, state, before, lowest, highest, v.sensors, figures,
                   observation, 0, 1)  # fmt: skip

    return take


@exact
def begin_episode(b, starts, r, i):
    """Begin an episode of valve i: its own start at first, later one that is drawn from all starts."""
    j, count = i % len(starts.episodes), np.uint64(r.started[i])
    if r.started[i] > 0:
        drawn, _, _, _ = philox(b.keys[i], np.uint64(i), np.uint64(0), count, np.uint64(EPISODE))
        j = np.int64(drawn % np.uint64(len(starts.episodes)))
    b.episodes[i], b.progress[i] = starts.episodes[j], starts.progress[j]
    b.sensors[i], b.keys[i] = starts.sensors[j], starts.keys[j]
    for row in range(b.numbers.shape[0]):
        b.numbers[row, i] = starts.numbers[row, j]
    r.started[i] += 1
    observe(b.episodes[i], r.observation[i])


@cache
def step_kernel(rule: Callable[..., Any], kernel: int) -> Any:
    """The kernel that takes one control period of all valves.

    rule: of one action (actions.py). kernel: as of `one_period`. ending: INSTEAD, AFTER or KEEP.
    """
    take = one_period(kernel)

    @cuda.jit
    def step(b, starts, r, rules, actions, slots, limits, ending):
        i = cuda.grid(1)
        if i >= len(b.episodes):
            return
        r.begun[i] = ending == INSTEAD and r.ended[i]
        if r.begun[i]:
            begin_episode(b, starts, r, i)
            r.reward[i] = 0.0
            for row in range(r.figures.shape[0]):
                r.figures[row, i] = 0.0
            r.terminated[i] = r.truncated[i] = r.ended[i] = False
            return
        e, noise = b.episodes[i], cuda.local.array((1, 1, 4), float64)
        draw_normals(b.keys[i], i, r.started[i], e.steps + 1, NOISE, e.noise, noise[0, 0])
        on_time, action, valid = rule(float(actions[i]), rules[0].control_period, slots)
        figures, observation = r.figures[:, i : i + 1], r.observation[i : i + 1]
        take(alone(b, i), rules, on_time, action, noise, figures, observation)
        r.reward[i] = r.figures[REWARD, i] if valid else math.nan
        r.terminated[i], r.truncated[i] = r.figures[FAILED, i] != 0.0, e.steps >= limits[i]
        r.ended[i] = r.terminated[i] or r.truncated[i]
        if ending == AFTER and r.ended[i]:
            for k in range(r.observation.shape[1]):
                r.final_observation[i, k] = r.observation[i, k]
            begin_episode(b, starts, r, i)

    return step


@cache
def episodes_kernel(
    decide: Callable[..., Any], memory: np.dtype, count: Callable[..., Any], kernel: int
) -> Any:
    """The kernel that runs whole episodes of the on/off environment under a controller.

    A lane takes an episode from the queue, runs it to its end and takes the next one. What is drawn
    follows from the episode's key, so lanes do not matter.

    decide: of a controller of one valve, with its memory's record (controllers/base.py). count: of an
    episode's period (training/evaluation/metrics.py). kernel: as of `one_period`.
    """
    take = one_period(kernel)

    @cuda.jit
    def run(b, rules, constants, blank, noise, periods, restart, queue, meters, record):
        own, drawn = cuda.local.array(1, memory), cuda.local.array((1, 1, 4), float64)
        figures = cuda.local.array((N_FIGURE, 1), float64)
        seen, readings = cuda.local.array((1, ENTRIES), float32), cuda.local.array(1, READINGS)
        period, settling_time = rules[0].control_period, rules[0].settling_time
        while True:
            i = cuda.atomic.add(queue, 0, 1)
            if i >= len(meters):
                break
            v, e, m = alone(b, i), b.episodes[i], meters[i]
            observe(e, seen[0])
            for k in range(periods):
                if k == 0 or k == restart:
                    own[0] = blank[0]
                read(readings[0], seen[0])
                action = decide(own[0], readings[0], seen[0], constants, period)
                draw_normals(b.keys[i], 0, 0, k + 1, NOISE, e.noise, drawn[0, 0])
                for c in range(noise.shape[2]):
                    drawn[0, 0, c] = e.noise * noise[i, k + 1, c]
                on_time, share, _ = on_off(action, period, 1)
                take(v, rules, on_time, share, drawn, figures, seen)
                count(m, figures, 0, v.numbers[COIL_ENERGY, 0], period, settling_time)
                if len(record) > 0:
                    record[k, 0, i], record[k, 1, i] = action, v.numbers[P2, 0]
                if m.failed > 0.0:
                    break

    return run
