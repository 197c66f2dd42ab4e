"""Locating, within one step, the instant at which the right-hand side changes its form.

Scalar and rarely called: only for the few lanes whose trial step passed an event.
"""

import numba

from epv_env.plant.primitives.compiled import FLAGS, inlined

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
