"""One trial step of every lane of a block, and the events that end a step early.

A step that would pass a stop, let a held mover go, or cross the stroke where the curtain of a magnet
valve seat exceeds its bore (a kink of the flow area) is not accepted: the instant is located on the
step's own interpolant and the step is taken again up to it. Between such instants the right-hand side
is smooth but for the seam of the laminar region, where pressures have all but met; so the classical
Runge-Kutta method keeps its fourth order (docs/explanation/numerical-integration.md).

The functions that locate are scalar and rarely called: only for the few lanes that passed an event.
"""

import numba

from epv_env.plant.effects.coil import coil_current
from epv_env.plant.effects.registry import with_laws
from epv_env.plant.effects.step_limits import longest_step
from epv_env.plant.equations import State, derivative
from epv_env.plant.lanes import (
    COEFFICIENT,
    EFFECT,
    EVENT,
    FORCE,
    HIGHEST,
    HINT,
    INPUT,
    LANES,
    LOCATED,
    LOWEST,
    REMAINING,
    STATE,
    TRIAL,
    TRIED,
    chosen_state,
    coefficients_at,
    effects_at,
    inputs_at,
    state_at,
    store_nominal,
    store_state,
)
from epv_env.plant.primitives import FLAGS, inlined, replacing, wide_vectors
from epv_env.plant.runge_kutta import (
    LONGEST,
    first_step,
    held_still,
    is_held,
    next_step,
    relative_error,
    remaining_stages,
)

BISECTIONS = 24
"""Halvings of the step: 250 us / 2^24 is far below the clock of anything here."""

compiled = numba.njit(**FLAGS)


@inlined
def turning_point(v0, v1):
    """Fraction of the step at which a mover's speed changes sign, taken linear; 1 if it does not."""
    turns = v0 * v1 < 0.0
    return v0 / (v0 - v1) if turns else 1.0


@inlined
def hermite(x0, v0, x1, v1, h, s):
    """Cubic through both ends' positions and speeds at fraction s of a step of h."""
    rest = 1.0 - s
    ends = rest * rest * (1.0 + 2.0 * s) * x0 + s * s * (3.0 - 2.0 * s) * x1
    return ends + h * s * rest * (rest * v0 - s * v1)


@compiled
def crossing(x0, v0, x1, v1, h, target, until):
    """Fraction of the step at which x, beyond target at the fraction `until`, passes it before that.

    1 if x does not pass. A mover that starts on the target (a rebound) and comes back is caught at its
    return.
    """
    above = hermite(x0, v0, x1, v1, h, until) > target
    if above == (x0 > target) and x0 != target:
        return 1.0
    before, after = 0.0, until
    for _ in range(BISECTIONS):
        middle = 0.5 * (before + after)
        if (hermite(x0, v0, x1, v1, h, middle) > target) == above:
            after = middle
        else:
            before = middle
    return after


@compiled
def release(force, force_mid, force_end):
    """Fraction of the step at which the force on a held mover changes sign; 1 if it does not.

    Bisection on the parabola through the start, the middle and the end.
    """
    if (force > 0.0) == (force_end > 0.0):
        return 1.0
    before, after = 0.0, 1.0
    for _ in range(BISECTIONS):
        s = 0.5 * (before + after)
        value = (
            force * (1.0 - s) * (1.0 - 2.0 * s)
            + force_mid * 4.0 * s * (1.0 - s)
            + force_end * s * (2.0 * s - 1.0)
        )
        if (value > 0.0) == (force_end > 0.0):
            after = s
        else:
            before = s
    return after


LANDING = 1e-8
"""A mover closer than this to the stop it runs into has landed [m]."""

STICK_SPEED = 5e-3
"""A rebound slower than this ends at the stop [m/s]: with restitution, rebounds would never end."""

MOST_RESTITUTION = 0.95
"""Greatest restitution to which a law may raise that of the armature [-]."""

RELEASE_MARGIN = 1e-7
"""Time by which a located release is overstepped, so that the next step finds the mover free [s]."""

RELEASE_LOCATIONS = 3
"""How often a release is located with effects, each time on a step that ends at the last instant found.
Friction ends as a stop lets go, so that an error of the instant counts to first order."""

SHORTEST_STEP = 1e-10
"""Every step makes at least this much progress [s]."""

_with_landing = replacing(State, "xPV", "vPV", "xMV", "vMV", "I_coil")

UNLIMITED = 1e9
"""A step hint that never binds [s]."""


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


def _stepper(lanes):
    """`try_steps` of a block of so many lanes: LLVM has to know their number."""

    @inlined
    def try_steps(work, step, extended):
        """A trial step in every lane; accepted where it passes no event and is accurate enough."""
        if lanes > 1:
            wide_vectors()
        for lane in range(lanes):
            q = state_at(work, STATE, lane)
            c = coefficients_at(work, COEFFICIENT, lane)
            effects = effects_at(work, EFFECT, lane)
            u = inputs_at(work, INPUT, lane)
            remaining, hint, located = work[REMAINING, lane], work[HINT, lane], work[LOCATED, lane]

            rates, force_PV, force_MV = derivative(q, u, c, effects, 1.0, 1.0, extended)
            held_PV = is_held(q.xPV, q.vPV, c.xPVmax, force_PV)
            held_MV = is_held(q.xMV, q.vMV, c.xMVmax, force_MV)
            free_PV = 0.0 if held_PV else 1.0
            free_MV = 0.0 if held_MV else 1.0
            longest = first_step(rates, step, LONGEST * step) if held_PV & held_MV else step
            h = min(min(longest, hint), remaining)
            if extended is not None:
                h = min(h, longest_step(u.U, q, effects, free_PV, free_MV))
            end, forces, difference = remaining_stages(
                q, held_still(rates, free_PV, free_MV), u, c, effects, free_PV, free_MV, h, extended
            )
            mid_PV, mid_MV, end_PV, end_MV = forces

            beyond = _overruns(q.xPV, q.vPV, end.xPV, end.vPV, h, c.xPVmax)
            beyond |= _overruns(q.xMV, q.vMV, end.xMV, end.vMV, h, c.xMVmax)
            kinked = _passes(q.xMV, end.xMV, c.kink_in) | _passes(q.xMV, end.xMV, c.kink_exh)
            let_go = _lets_go(held_PV, force_PV, end_PV) | _lets_go(held_MV, force_MV, end_MV)
            again = (located == 1.0) & (h > step)  # located once, on too long a step to be exact
            if extended is not None:
                again |= (located > 0.0) & (located < RELEASE_LOCATIONS)
            event = beyond | ((located == 0.0) & (kinked | let_go)) | (again & let_go)
            error = relative_error(difference, h, step, extended)
            wrong = (error > 1.0) & (h > step)
            refused = event | wrong

            xPV, vPV = _landed(end.xPV, end.vPV, c.xPVmax, c.ePV)
            current, restitution_MV = end.I, 0.0
            if extended is not None:
                acting = with_laws(end, effects, extended)
                restitution_MV = min(acting.restitution_MV, MOST_RESTITUTION)
                current = coil_current(u.U, end.I, c.R, end.coil_heat, acting)
            xMV, vMV = _landed(end.xMV, end.vMV, c.xMVmax, restitution_MV)
            landed = _with_landing(end, xPV, vPV, xMV, vMV, current)
            reached = chosen_state(refused, q, landed)
            if extended is not None:
                store_state(work, TRIAL, lane, end)
                store_state(work, STATE, lane, reached)
            else:
                store_nominal(work, TRIAL, lane, end)
                store_nominal(work, STATE, lane, reached)
            work[REMAINING, lane] = remaining if refused else remaining - h
            work[TRIED, lane] = h
            controlled = wrong | (hint < UNLIMITED)
            work[HINT, lane] = (
                max(next_step(h, error), step) if controlled & (located == 0.0) else UNLIMITED
            )
            work[LOCATED, lane] = located if refused else 0.0
            work[EVENT, lane] = 1.0 if event & (not wrong) else 0.0
            work[FORCE, lane], work[FORCE + 1, lane], work[FORCE + 2, lane] = force_PV, mid_PV, end_PV
            work[FORCE + 3, lane], work[FORCE + 4, lane] = force_MV, mid_MV
            work[FORCE + 5, lane] = end_MV
            work[LOWEST, lane] = min(work[LOWEST, lane], reached.p2)
            work[HIGHEST, lane] = max(work[HIGHEST, lane], reached.p2)

    return try_steps


try_steps = _stepper(LANES)
"""Of a block of the CPU."""

try_step = _stepper(1)
"""Of one valve: an accelerator's thread."""


@inlined
def locate_event(work, lane):
    """Let the next step of a lane that met an event end at the event."""
    start, trial = state_at(work, STATE, lane), state_at(work, TRIAL, lane)
    c = coefficients_at(work, COEFFICIENT, lane)
    work[HINT, lane] = _locate(start, trial, work[TRIED, lane], c, work, lane)
    work[LOCATED, lane] += 1.0
