"""Compiled, batched, event-exact integration of the valve.

Sixteen valves ("lanes") go through one loop as SIMD registers, each with a clock and a step of its own.
A step that would pass a stop, let a held mover go, or cross the stroke where the curtain of a magnet
valve seat exceeds its bore (a kink of the flow area) is not accepted: the instant is located on the
step's own interpolant and the step is taken again up to it. Between such instants the right-hand side
is smooth but for the seam of the laminar region, where pressures have all but met; so the classical
Runge-Kutta method keeps its fourth order (docs/explanation/numerical-integration.md).

Every valve, alone or in a batch of thousands, runs through the same instructions in a block of
sixteen; so its trajectory does not depend, to the bit, on its companions or on the number of threads.
"""

import numba
import numpy as np

from epv_env.plant.effects.coil import coil_current
from epv_env.plant.effects.step_limits import longest_step
from epv_env.plant.equations import State, derivative
from epv_env.plant.events import crossing, hermite, release, turning_point
from epv_env.plant.lanes import (
    COEFFICIENT,
    EFFECT,
    EVENT,
    FORCE,
    GIVEN_UP,
    HIGHEST,
    HINT,
    INPUT,
    LANES,
    LOWEST,
    N_COEFFICIENT,
    N_EFFECT,
    N_INPUT,
    N_STATE,
    REMAINING,
    STATE,
    TRIAL,
    chosen_state,
    coefficients_at,
    copy_rows,
    effects_at,
    inputs_at,
    new_workspace,
    state_at,
    store_nominal,
    store_state,
)
from epv_env.plant.primitives.compiled import FLAGS, inlined, replacing, source_digest
from epv_env.plant.runge_kutta import held_still, is_held, remaining_stages

DEFAULT_STEP = 250e-6
"""Largest step while a piston or armature moves [s]; twice that while both are held."""

LANDING = 1e-8
"""A mover closer than this to the stop it runs into has landed [m]."""

STICK_SPEED = 5e-3
"""A rebound slower than this ends at the stop [m/s]: with restitution, rebounds would never end."""

RELEASE_MARGIN = 1e-7
"""Time by which a located release is overstepped, so that the next step finds the mover free [s]."""

SHORTEST_STEP = 1e-10
"""Every step makes at least this much progress [s]."""

MAX_STEPS = 200_000
"""Steps per period after which a lane is given up (its state becomes NaN)."""

_with_landing = replacing(State, "xPV", "vPV", "xMV", "vMV", "I_coil")

_UNLOCATED = 1e9  # a step hint that never binds


@inlined
def _landed(x, v, x_max, restitution):
    """Position, within the stops, and speed after a possible impact on one of them."""
    low = (x <= LANDING) & (v < 0.0)
    high = (x >= x_max - LANDING) & (v > 0.0)
    rebound = -restitution * v
    rebound = rebound if abs(rebound) > STICK_SPEED else 0.0
    x = 0.0 if low else (x_max if high else min(max(x, 0.0), x_max))
    return x, rebound if low | high else v


@inlined
def _overruns(x0, v0, x1, v1, h, x_max):
    """Whether a mover is beyond a stop at the end of the step, or where it turns within it."""
    x = hermite(x0, v0, x1, v1, h, turning_point(v0, v1))
    return (min(x, x1) < -LANDING) | (max(x, x1) > x_max + LANDING)


@inlined
def _passes(x0, x1, kink):
    """Whether a step runs through a kink that it did not start on."""
    return (abs(x0 - kink) > LANDING) & ((x0 - kink) * (x1 - kink) < 0.0)


@inlined
def _lets_go(held, force, force_end):
    """Whether the force that presses a held mover on its stop has changed sign."""
    return held & (force * force_end < 0.0)


@inlined
def _passing(x0, v0, x1, v1, h, x_max):
    """Fraction of the step at which a mover runs into either stop, on its way or at its end."""
    turn = turning_point(v0, v1)
    for until in (turn, 1.0):
        x = hermite(x0, v0, x1, v1, h, until)
        if x > x_max:
            return crossing(x0, v0, x1, v1, h, x_max, until)
        if x < 0.0:
            return crossing(x0, v0, x1, v1, h, 0.0, until)
    return 1.0


@numba.njit(**FLAGS)
def _locate(start, trial, h, c, work, lane):
    """Step from `start` to the first event on the way to `trial` [s].

    start, trial: States before and after a step of h. c: the valve's Coefficients.
    """
    fraction = min(
        _passing(start.xPV, start.vPV, trial.xPV, trial.vPV, h, c.xPVmax),
        _passing(start.xMV, start.vMV, trial.xMV, trial.vMV, h, c.xMVmax),
    )
    for kink in (c.kink_in, c.kink_exh):
        if abs(start.xMV - kink) > LANDING:
            passed = crossing(start.xMV, start.vMV, trial.xMV, trial.vMV, h, kink, 1.0)
            fraction = min(fraction, passed)
    released = 1.0
    if is_held(start.xPV, start.vPV, c.xPVmax, work[FORCE, lane]):
        released = release(work[FORCE, lane], work[FORCE + 1, lane], work[FORCE + 2, lane])
    if is_held(start.xMV, start.vMV, c.xMVmax, work[FORCE + 3, lane]):
        at = release(work[FORCE + 3, lane], work[FORCE + 4, lane], work[FORCE + 5, lane])
        released = min(released, at)
    return max(min(fraction * h, released * h + RELEASE_MARGIN), SHORTEST_STEP)


@inlined
def _try_steps(work, step, extended):
    """Take one trial step in every lane; accept it where it passes no event."""
    for lane in range(LANES):
        q = state_at(work, STATE, lane)
        c = coefficients_at(work, COEFFICIENT, lane)
        effects = effects_at(work, EFFECT, lane)
        u = inputs_at(work, INPUT, lane)
        remaining, hint = work[REMAINING, lane], work[HINT, lane]

        rates, force_PV, force_MV = derivative(q, u, c, effects, 1.0, 1.0, extended)
        held_PV = is_held(q.xPV, q.vPV, c.xPVmax, force_PV)
        held_MV = is_held(q.xMV, q.vMV, c.xMVmax, force_MV)
        free_PV = 0.0 if held_PV else 1.0
        free_MV = 0.0 if held_MV else 1.0
        h = min(min(2.0 * step if held_PV & held_MV else step, hint), remaining)
        if extended:
            h = min(h, longest_step(u.U, q, effects, free_PV, free_MV))
        end, mid_PV, mid_MV, end_PV, end_MV = remaining_stages(
            q, held_still(rates, free_PV, free_MV), u, c, effects, free_PV, free_MV, h, extended
        )

        unlocated = hint >= _UNLOCATED
        beyond = _overruns(q.xPV, q.vPV, end.xPV, end.vPV, h, c.xPVmax)
        beyond |= _overruns(q.xMV, q.vMV, end.xMV, end.vMV, h, c.xMVmax)
        kinked = _passes(q.xMV, end.xMV, c.kink_in) | _passes(q.xMV, end.xMV, c.kink_exh)
        let_go = _lets_go(held_PV, force_PV, end_PV) | _lets_go(held_MV, force_MV, end_MV)
        event = beyond | (unlocated & (kinked | let_go))

        xPV, vPV = _landed(end.xPV, end.vPV, c.xPVmax, c.ePV)
        xMV, vMV = _landed(end.xMV, end.vMV, c.xMVmax, c.eMV)
        current = coil_current(u.U, end.I, c.R, end.coil_heat, effects) if extended else end.I
        landed = _with_landing(end, xPV, vPV, xMV, vMV, current)
        reached = chosen_state(event, q, landed)
        if extended:
            store_state(work, TRIAL, lane, end)
            store_state(work, STATE, lane, reached)
        else:
            store_nominal(work, TRIAL, lane, end)
            store_nominal(work, STATE, lane, reached)
        work[REMAINING, lane] = remaining if event else remaining - h
        work[HINT, lane] = h if event else _UNLOCATED
        work[EVENT, lane] = 1.0 if event else 0.0
        work[FORCE, lane], work[FORCE + 1, lane], work[FORCE + 2, lane] = force_PV, mid_PV, end_PV
        work[FORCE + 3, lane], work[FORCE + 4, lane] = force_MV, mid_MV
        work[FORCE + 5, lane] = end_MV
        work[LOWEST, lane] = min(work[LOWEST, lane], reached.p2)
        work[HIGHEST, lane] = max(work[HIGHEST, lane], reached.p2)


@inlined
def _locate_events(work):
    """Shorten the next step of each lane that met an event. Returns whether any lane has time left."""
    pending = False
    for lane in range(LANES):
        if work[EVENT, lane] != 0.0:
            work[HINT, lane] = _locate(
                state_at(work, STATE, lane),
                state_at(work, TRIAL, lane),
                work[HINT, lane],
                coefficients_at(work, COEFFICIENT, lane),
                work,
                lane,
            )
        pending |= work[REMAINING, lane] > 0.0
    return pending


@inlined
def _run_block(work, step, extended):
    """Step every lane of a block until its remaining time is used up; give up those that do not end."""
    for _ in range(MAX_STEPS):
        _try_steps(work, step, extended)
        if not _locate_events(work):
            return
    for lane in range(LANES):
        if not work[REMAINING, lane] <= 0.0:
            work[:N_STATE, lane] = np.nan
            work[GIVEN_UP, lane] = 1.0


@inlined
def _run(state, coefficients, effects, inputs, duration, lowest, highest, record, step, first, last,
         extended):  # fmt: skip
    """Body of `run_nominal` and `run_extended`."""
    work = new_workspace()
    for at in range(first, last, LANES):
        copy_rows(state, 0, at, work, STATE, 0, N_STATE)
        copy_rows(coefficients, 0, at, work, COEFFICIENT, 0, N_COEFFICIENT)
        copy_rows(effects, 0, at, work, EFFECT, 0, N_EFFECT)
        for lane in range(LANES):
            work[GIVEN_UP, lane] = 0.0
            work[LOWEST, lane] = lowest[at + lane]
            work[HIGHEST, lane] = highest[at + lane]
        for period in range(inputs.shape[0]):
            copy_rows(inputs[period], 0, at, work, INPUT, 0, N_INPUT)
            for lane in range(LANES):
                lasts = duration[period, at + lane]
                work[REMAINING, lane] = 0.0 if work[GIVEN_UP, lane] != 0.0 else lasts
                work[HINT, lane] = _UNLOCATED
            _run_block(work, step, extended)
            if record.shape[0] > 0:
                copy_rows(work, STATE, 0, record[period], 0, at, N_STATE)
        copy_rows(work, STATE, 0, state, 0, at, N_STATE)
        for lane in range(LANES):
            lowest[at + lane] = work[LOWEST, lane]
            highest[at + lane] = work[HIGHEST, lane]


# Closed over by the kernels: a change of any inlined source changes their key in the disk cache.
_DIGEST = source_digest()


def _compile(extended, digest):
    @numba.njit(cache=True, nogil=True, **FLAGS)
    def run(state, coefficients, effects, inputs, duration, lowest, highest, record, step, first,
            last):  # fmt: skip
        if digest == "":  # keeps the digest in the closure
            return
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
