"""The rules of one control period for one episode, compiled: drive, judge, measure, observe.

e: a record of EPISODE. rules: a record of RULES. They are inlined into `epv_env.compiled_step`.
"""

from dataclasses import fields

import numpy as np

from epv_env.common.units import BAR
from epv_env.episode import TARGET_STEPS
from epv_env.observation import (
    CENTRE,
    HISTORY,
    INDEX,
    LIMIT,
    LONGEST_WAIT,
    P2_LAGS,
    P3_LAGS,
    SCALE,
    scaled,
)
from epv_env.plant.channels import CHANNEL
from epv_env.plant.data_acquisition import digitised
from epv_env.plant.primitives.compiled import exact, generated
from epv_env.plant.readings import MEASURED
from epv_env.plant.supply import two_point
from epv_env.result import DEVIATION, FAILED, N_TERM, REWARD, SUCCEEDED, SWITCHINGS, VENTED
from epv_env.reward import BAND_BAR, RewardWeights, priced, total
from epv_env.settings import EMPTY_CIRCUIT_BAR, Settings

RULES = np.dtype(
    [
        (name, np.float64)
        for name in (
            "control_period",
            "supply_voltage",
            "settling_time",
            *(f.name for f in fields(RewardWeights)),
        )
    ]
)
"""Record of the settings that a period needs, by their names."""

_digitised, _two_point, _scaled = exact(digitised), exact(two_point), exact(scaled)
_priced, _total = exact(priced), exact(total)

_SENSOR = np.array([CHANNEL[name].sensor.constants() for name in MEASURED])
_P1, _P2, _P3, _I = (MEASURED.index(name) for name in ("p1", "p2", "p3", "I"))
_ERROR, _TARGET, _SHOWN_P1, _SHOWN_P3, _SHOWN_I, _ACTION, _WAITED = (
    INDEX[name] for name in ("p2_error", "target", "p1", "p3", "I", "action", "since_switching")
)
_P2_CHANGE, _P3_CHANGE = INDEX[f"p2_change_{P2_LAGS[0]}"], INDEX[f"p3_change_{P3_LAGS[0]}"]
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
    e.compressor = _two_point(p1, e.compressor, e.cut_in, e.cut_out) and begin >= e.idle_until
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
    terms = _priced(
        rules, rules.control_period, error, above, below, figures[SWITCHINGS, i], vented, failed
    )
    for row in range(N_TERM):
        figures[row, i] = terms[row]
    figures[REWARD, i] = _total(terms)
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
        e.reading[k] = _digitised(true[k], normal[k], low, noise, resolution, least, greatest)


@exact
def remember(e):
    """Put the readings at the front of the histories."""
    for k in range(HISTORY - 1, 0, -1):
        e.p2_history[k] = e.p2_history[k - 1]
        e.p3_history[k] = e.p3_history[k - 1]
    e.p2_history[0] = e.reading[_P2]
    e.p3_history[0] = e.reading[_P3]


@exact
def remember_only(e):
    """Let the past of an episode that has just begun be its present."""
    for k in range(HISTORY):
        e.p2_history[k] = e.reading[_P2]
        e.p3_history[k] = e.reading[_P3]


@exact
def _show(row, k, value):
    """Write entry k of an observation."""
    row[k] = _scaled(value, CENTRE[k], SCALE[k], LIMIT[k])


@exact
def observe(e, row):
    """Write the observation of an episode, (entries,) [-]."""
    p2, p3 = e.p2_history, e.p3_history
    _show(row, _ERROR, p2[0] - e.target)
    _show(row, _TARGET, e.target)
    _show(row, _SHOWN_P1, e.reading[_P1])
    _show(row, _SHOWN_P3, p3[0])
    _show(row, _SHOWN_I, e.reading[_I])
    _show(row, _ACTION, e.action)
    _show(row, _WAITED, min(e.waited, LONGEST_WAIT))
    for k in range(len(P2_LAGS)):
        _show(row, _P2_CHANGE + k, p2[0] - p2[P2_LAGS[k]])
    for k in range(len(P3_LAGS)):
        _show(row, _P3_CHANGE + k, p3[0] - p3[P3_LAGS[k]])
