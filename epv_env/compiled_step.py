"""The step of a batch in one compiled call: prepare all inputs, integrate, judge and observe.

All functions take the same arguments, n episodes in `lanes` lanes of the plant's tables:

episodes, progress: records of EPISODE (n,) and PROGRESS (n,). rules: a record of RULES (1,).
noise: standard normal draws times the task's factor, (n, NOISE_BLOCK, 4).
state, coefficients, effects, lowest, highest, sensors: `Valves.tables`.
before: the state before the period, (N_STATE, lanes). inputs (2, N_INPUT, lanes), duration (2, lanes):
of the part with the coil on, if there is one, and of the part with it off.
record: empty. step: largest integration step [s].
on_time (n,) [s], action (n,) [-]: what is commanded.
figures (N_FIGURE, n), observation (n, entries) float32: results.
first, last: lanes, multiples of LANES.
"""

from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np

from epv_env.period import (
    follow_target_steps,
    judge,
    measure,
    observe,
    refilled,
    remember,
    remember_only,
    switched,
)
from epv_env.plant.consumption import mean_flow
from epv_env.plant.equations import Inputs, State
from epv_env.plant.integrate import run_nominal
from epv_env.plant.lanes import N_STATE, STATE, state_at
from epv_env.plant.primitives.compiled import exact, source_digest, wide_vectors
from epv_env.result import CONSUMPTION, FAILED, SWITCHINGS

NOISE_BLOCK = 256
"""Samples of noise drawn at a time for each episode."""

_P1, _P2, _VENTED = (State._fields.index(name) for name in ("p1", "p2", "air_vented"))
_U, _FLOW, _SLOPE, _REFILL = (
    Inputs._fields.index(name) for name in ("U", "sigma_S", "p1_slope", "refill")
)


@exact
def _prepare(episodes, progress, rules, state, before, inputs, duration, lowest, highest, on_time,
             action, figures, first, last):  # fmt: skip
    """Set inputs and durations of both parts of the period, and keep the state."""
    period, voltage = rules[0].control_period, rules[0].supply_voltage
    before[:, first:last] = state[:, first:last]
    lowest[first:last] = np.inf
    highest[first:last] = -np.inf
    for i in range(first, min(last, len(episodes))):
        e, on = episodes[i], on_time[i]
        figures[SWITCHINGS, i] = switched(e, period, on, action[i])
        begin = e.steps * period
        flow = mean_flow(progress[i], begin, period)
        figures[CONSUMPTION, i] = flow
        refill = refilled(e, state[_P1, i], begin)
        follow_target_steps(e, begin + period)
        for part in range(2):
            inputs[part, _FLOW, i] = flow
            inputs[part, _SLOPE, i] = e.p1_slope
            inputs[part, _REFILL, i] = refill
        inputs[0, _U, i] = voltage if on > 0.0 else 0.0
        whole = on <= 0.0 or on >= period
        duration[0, i] = period if whole else on
        duration[1, i] = 0.0 if whole else period - on


@exact
def _restore_lost(episodes, state, before, lowest, highest, figures, first, last):
    """Put valves that could not be integrated back where they were, and mark them as failed.

    A loop of its own: arrays that are handed to a function for every valve are counted every time.
    """
    for i in range(first, min(last, len(episodes))):
        figures[FAILED, i] = 0.0
        if np.isnan(state[_P2, i]):
            figures[FAILED, i] = 1.0
            for row in range(N_STATE):
                state[row, i] = before[row, i]
            lowest[i] = before[_P2, i]
            highest[i] = before[_P2, i]


@exact
def _conclude(episodes, rules, noise, state, before, lowest, highest, sensors, figures, observation,
              first, last):  # fmt: skip
    """Judge the period, read the sensors and write the observations."""
    _restore_lost(episodes, state, before, lowest, highest, figures, first, last)
    period = rules[0].control_period
    for i in range(first, min(last, len(episodes))):
        e = episodes[i]
        vented = state[_VENTED, i] - before[_VENTED, i]
        judge(e, rules[0], state[_P2, i], lowest[i], highest[i], vented, figures, i)
        measure(
            e, state_at(state, STATE, i), sensors[i], noise[i, e.steps % NOISE_BLOCK], e.steps * period
        )
        remember(e)
        observe(e, observation[i])


# Closed over by the compiled functions: a change of any inlined source changes their key in the cache.
_DIGEST = source_digest(*Path(__file__).parent.glob("*.py"))


def _compiled(digest):
    """The step as a whole for nominal valves, and its two ends for others."""

    def compiled(function: Callable[..., None]) -> Callable[..., None]:
        return numba.njit(function, cache=True, nogil=True, error_model="numpy")

    @compiled
    def whole(episodes, progress, rules, noise, state, coefficients, effects, lowest, highest, sensors,
              before, inputs, duration, record, step, on_time, action, figures, observation, first,
              last):  # fmt: skip
        if digest == "":  # keeps the digest in the closure
            return
        wide_vectors()  # the preference of run_nominal is lost where that is inlined here
        _prepare(episodes, progress, rules, state, before, inputs, duration, lowest, highest, on_time,
                 action, figures, first, last)  # fmt: skip
        parts = 2 if np.any(duration[1, first:last] > 0.0) else 1
        run_nominal(state, coefficients, effects, inputs[:parts], duration[:parts], lowest, highest,
                    record, step, first, last)  # fmt: skip
        _conclude(episodes, rules, noise, state, before, lowest, highest, sensors, figures,
                  observation, first, last)  # fmt: skip

    @compiled
    def prepare(episodes, progress, rules, noise, state, coefficients, effects, lowest, highest,
                sensors, before, inputs, duration, record, step, on_time, action, figures, observation,
                first, last):  # fmt: skip
        if digest == "":
            return
        _prepare(episodes, progress, rules, state, before, inputs, duration, lowest, highest, on_time,
                 action, figures, first, last)  # fmt: skip

    @compiled
    def conclude(episodes, progress, rules, noise, state, coefficients, effects, lowest, highest,
                 sensors, before, inputs, duration, record, step, on_time, action, figures, observation,
                 first, last):  # fmt: skip
        if digest == "":
            return
        _conclude(episodes, rules, noise, state, before, lowest, highest, sensors, figures,
                  observation, first, last)  # fmt: skip

    @compiled
    def begin(episodes, noise, state, sensors, where, observation):
        if digest == "":
            return
        for i in where:
            measure(episodes[i], state_at(state, STATE, i), sensors[i], noise[i, 0], 0.0)
            remember_only(episodes[i])
        for i in range(len(episodes)):
            observe(episodes[i], observation[i])

    return whole, prepare, conclude, begin


step_whole, step_prepare, step_conclude, observe_first = _compiled(_DIGEST)
