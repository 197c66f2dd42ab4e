"""One control period of a batch in one compiled call: drive, integrate, judge, measure, observe.

The rules are functions of one episode, e, a record of EPISODE; rules: a record of RULES. The compiled
step at the end calls them for all, n episodes in `lanes` lanes of the plant's tables:

episodes, progress: records of EPISODE (n,) and PROGRESS (n,). rules: a record of RULES (1,).
noise: standard normal draws times the task's factor, (n, NOISE_BLOCK, 4).
state, coefficients, effects, lowest, highest, sensors: `Valves.tables`.
before: the state before the period, (N_STATE, lanes). inputs (2, N_INPUT, lanes), duration (2, lanes):
of the part with the coil on, if there is one, and of the part with it off.
record: empty. step: largest integration step [s].
on_time (n,) [s], action (n,) [-]: what is commanded.
figures (N_FIGURE, n), observation (n, entries) float32: results.
first, last: lanes, multiples of LANES. begins, ends: whether to begin and to end the period; valves are
integrated in between only if both, so they must be nominal.
"""

import math
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import numba
import numpy as np

from epv_env.common.units import BAR
from epv_env.episode import TARGET_STEPS
from epv_env.observation import HISTORY, LONGEST_WAIT, write
from epv_env.plant.channels import CHANNEL, MEASURED, digitised
from epv_env.plant.consumption import mean_flow
from epv_env.plant.equations import Inputs, State
from epv_env.plant.integrate import run_nominal
from epv_env.plant.lanes import N_STATE, STATE, state_at
from epv_env.plant.primitives import exact, generated, source_digest, wide_vectors
from epv_env.plant.supply import two_point
from epv_env.result import CONSUMPTION, DEVIATION, FAILED, N_TERM, REWARD, SUCCEEDED, SWITCHINGS, VENTED
from epv_env.reward import BAND_BAR, EMPTY_CIRCUIT_BAR, RewardWeights, reward_terms, total
from epv_env.settings import Settings

# np.record: the fields are attributes where numba's simulator runs the functions as plain Python, too.
EPISODE = np.dtype((np.record, np.dtype(
    [
        ("target", np.float64),  # [bar absolute]
        ("steps", np.int64),  # control periods so far
        ("action", np.float64),  # share of the last period with the coil on [-]
        ("waited", np.float64),  # since the last switching [s]
        ("cut_in", np.float64),  # of the compressor [Pa absolute]
        ("cut_out", np.float64),  # of the compressor [Pa absolute]
        ("delivery", np.float64),  # of the running compressor [kg/s]
        ("p1_slope", np.float64),  # of a recorded supply over this period [Pa/s]
        ("reading", np.float64, (len(MEASURED),)),  # of each sensor [bar, A]
        ("p2_history", np.float64, (HISTORY,)),  # readings, the newest first [bar]
        ("p3_history", np.float64, (HISTORY,)),  # the same of p3 [bar]
        ("coil", np.bool_),  # on at the end of the last period
        ("compressor", np.bool_),  # running
        ("idle_until", np.float64),  # when the compressor may start [s]
        ("noise", np.float64),  # factor on the sensors' noise [-]
        ("p3_frozen_at", np.float64),  # when the reading of p3 stops changing [s]
        ("target_steps_at", np.float64, (TARGET_STEPS,)),  # [s]
        ("target_steps_to", np.float64, (TARGET_STEPS,)),  # [bar absolute]
        ("violated", np.bool_),  # outside the band after settling
    ],
    align=True,
)))  # fmt: skip
"""Record of a running episode."""

_RULES = ("control_period", "supply_voltage", "settling_time", *(f.name for f in fields(RewardWeights)))
RULES = np.dtype((np.record, [(name, np.float64) for name in _RULES]))
"""Record of the settings that a period needs, by their names."""

for _rule in (digitised, two_point, reward_terms, total):
    exact(_rule)

_SENSOR = np.array([CHANNEL[name].sensor.constants() for name in MEASURED])
_P1, _P2, _P3, _I = (MEASURED.index(name) for name in ("p1", "p2", "p3", "I"))
_EMPTY = EMPTY_CIRCUIT_BAR * BAR

_true_readings = generated(
    "true_readings",
    "state, p",
    f"return ({', '.join(f'{name}(state, p) / {CHANNEL[name].scale!r}' for name in MEASURED)},)",
    decorator=exact,
    **{c.name: exact(c.reading) for c in CHANNEL.values() if c.reading is not None},
)
"""What each sensor has before it [bar, A], from a State and a record of sensor parameters."""


def rules_of(settings: Settings) -> np.ndarray:
    """RULES of a task's settings, (1,)."""
    values = {**vars(settings), **vars(settings.weights)}
    return np.array([tuple(values[name] for name in RULES.names or ())], dtype=RULES)


@exact
def switched(e, period, on_time, action):
    """Switchings of the coil in a period with the coil on for its first `on_time` [s]."""
    begins_on, ends_on = on_time > 0.0, on_time >= period
    switchings = int(begins_on != e.coil) + int(begins_on != ends_on)
    if switchings > 0:
        e.waited = period - on_time if begins_on and not ends_on else period
    else:
        e.waited += period
    e.coil = ends_on
    e.action = action
    return switchings


@exact
def follow_target_steps(e, end):
    """Take the target that the steps have set when the period ends [s]."""
    for k in range(TARGET_STEPS):
        if end >= e.target_steps_at[k]:
            e.target = e.target_steps_to[k]


@exact
def refilled(e, p1, begin):
    """Delivery of the compressor [kg/s] at a supply pressure p1 [Pa] in the period from `begin` [s]."""
    e.compressor = two_point(p1, e.compressor, e.cut_in, e.cut_out) and begin >= e.idle_until
    return e.delivery * e.compressor


@exact
def judge(e, rules, p2, lowest, highest, vented, figures, i):
    """End a period: reward and figures of episode i.

    p2, lowest, highest: pressure at the end and its extremes [Pa]. vented: air blown off [kg]. Its
    switchings stand in the table, and whether the plant could not be integrated: the episode has then
    failed, for a learner must not meet a NaN.
    """
    e.steps += 1
    error, above, below = p2 / BAR - e.target, highest / BAR - e.target, lowest / BAR - e.target
    deviation = above if above > -below else below
    failed = figures[FAILED, i] != 0.0 or p2 <= _EMPTY
    settled = e.steps * rules.control_period > rules.settling_time
    e.violated |= settled and abs(deviation) > BAND_BAR
    terms = reward_terms(
        rules, rules.control_period, error, above, below, figures[SWITCHINGS, i], vented, failed
    )
    for row in range(N_TERM):
        figures[row, i] = terms[row]
    figures[REWARD, i] = total(terms)
    figures[FAILED, i] = failed
    figures[DEVIATION, i] = deviation
    figures[VENTED, i] = vented
    figures[SUCCEEDED, i] = settled and not e.violated and not failed


@exact
def measure(e, state, p, normal, time):
    """Read the sensors. p: their parameters, a record. normal: a draw for each (4,) [-]. time: [s]."""
    true = _true_readings(state, p)
    for k in range(len(MEASURED)):
        if k == _P3 and time > e.p3_frozen_at:
            continue
        low, noise, resolution, least, greatest = _SENSOR[k]
        e.reading[k] = digitised(true[k], normal[k], low, noise, resolution, least, greatest)


@exact
def remember(e):
    """Put the readings at the front of the histories."""
    for k in range(HISTORY - 1, 0, -1):
        e.p2_history[k] = e.p2_history[k - 1]
        e.p3_history[k] = e.p3_history[k - 1]
    e.p2_history[0] = e.reading[_P2]
    e.p3_history[0] = e.reading[_P3]


@exact
def observe(e, row):
    """Write the observation of an episode, (entries,) [-]."""
    waited = min(e.waited, LONGEST_WAIT)
    write(row, e, e.reading[_P1], e.reading[_I], e.target, e.action, waited)


NOISE_BLOCK = 256
"""Samples of noise drawn at a time for each episode."""

_ROW_P1, _ROW_P2, _ROW_VENTED = (State._fields.index(name) for name in ("p1", "p2", "air_vented"))
_U, _FLOW, _SLOPE, _REFILL = (
    Inputs._fields.index(name) for name in ("U", "sigma_S", "p1_slope", "refill")
)


@exact
def begin_period(episodes, progress, rules, state, before, inputs, duration, lowest, highest, on_time,
                 action, figures, first, last):  # fmt: skip
    """Set inputs and durations of both parts of the period, and keep the state."""
    period, voltage = rules[0].control_period, rules[0].supply_voltage
    for row in range(N_STATE):
        for lane in range(first, last):
            before[row, lane] = state[row, lane]
    for lane in range(first, last):
        lowest[lane], highest[lane] = np.inf, -np.inf
    for i in range(first, min(last, len(episodes))):
        e, on = episodes[i], on_time[i]
        figures[SWITCHINGS, i] = switched(e, period, on, action[i])
        begin = e.steps * period
        flow = mean_flow(progress[i], begin, period)
        figures[CONSUMPTION, i] = flow
        refill = refilled(e, state[_ROW_P1, i], begin)
        follow_target_steps(e, begin + period)
        for part in range(2):
            inputs[part, _FLOW, i] = flow
            inputs[part, _SLOPE, i] = e.p1_slope
            inputs[part, _REFILL, i] = refill
        inputs[0, _U, i], inputs[1, _U, i] = (voltage if on > 0.0 else 0.0), 0.0
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
        if math.isnan(state[_ROW_P2, i]):
            figures[FAILED, i] = 1.0
            for row in range(N_STATE):
                state[row, i] = before[row, i]
            lowest[i] = before[_ROW_P2, i]
            highest[i] = before[_ROW_P2, i]


@exact
def end_period(episodes, rules, noise, state, before, lowest, highest, sensors, figures, observation,
               first, last):  # fmt: skip
    """Judge the period, read the sensors and write the observations."""
    _restore_lost(episodes, state, before, lowest, highest, figures, first, last)
    period = rules[0].control_period
    for i in range(first, min(last, len(episodes))):
        e = episodes[i]
        vented = state[_ROW_VENTED, i] - before[_ROW_VENTED, i]
        judge(e, rules[0], state[_ROW_P2, i], lowest[i], highest[i], vented, figures, i)
        drawn = noise[i, e.steps % noise.shape[1]]
        measure(e, state_at(state, STATE, i), sensors[i], drawn, e.steps * period)
        remember(e)
        observe(e, observation[i])


INLINED = ("period", "episode", "observation", "result", "reward")
"""Files of this folder whose functions and constants the compiled step takes in."""

# Closed over by the compiled functions: a change of any inlined source changes their key in the cache.
_DIGEST = source_digest(*(Path(__file__).with_name(f"{name}.py") for name in INLINED))


def _compiled(digest):
    """The step of valves, and the start of episodes."""

    def compiled(function: Callable[..., None]) -> Callable[..., None]:
        return numba.njit(function, cache=True, nogil=True, error_model="numpy")

    @compiled
    def advance(episodes, progress, rules, noise, state, coefficients, effects, lowest, highest,
                sensors, before, inputs, duration, record, step, on_time, action, figures, observation,
                first, last, begins, ends):  # fmt: skip
        if digest == "":  # keeps the digest in the closure
            return
        wide_vectors()  # the preference of run_nominal is lost where that is inlined here
        if begins:
            begin_period(episodes, progress, rules, state, before, inputs, duration, lowest, highest,
                         on_time, action, figures, first, last)  # fmt: skip
        if begins and ends:
            parts = 2 if np.any(duration[1, first:last] > 0.0) else 1
            run_nominal(state, coefficients, effects, inputs[:parts], duration[:parts], lowest, highest,
                        record, step, first, last)  # fmt: skip
        if ends:
            end_period(episodes, rules, noise, state, before, lowest, highest, sensors, figures,
                       observation, first, last)  # fmt: skip

    @compiled
    def begin(episodes, noise, state, sensors, where, observation):
        if digest == "":
            return
        for i in where:
            measure(episodes[i], state_at(state, STATE, i), sensors[i], noise[i, 0], 0.0)
            for _ in range(HISTORY):  # the past of an episode that has just begun is its present
                remember(episodes[i])
        for i in range(len(episodes)):
            observe(episodes[i], observation[i])

    return advance, begin


step_period, observe_first = _compiled(_DIGEST)
