"""Locating, within one step, the instant at which the right-hand side changes its form.

Scalar and rarely called: only for the few lanes whose trial step passed an event.
"""

import numba

from epv_env.plant.compiled import FLAGS

BISECTIONS = 24
"""Halvings of the step: 250 us / 2^24 is far below the clock of anything here."""

compiled = numba.njit(**FLAGS)


@compiled
def hermite(x0, v0, x1, v1, h, s):
    """Cubic through both ends' positions and speeds at fraction s of a step of h."""
    rest = 1.0 - s
    ends = rest * rest * (1.0 + 2.0 * s) * x0 + s * s * (3.0 - 2.0 * s) * x1
    return ends + h * s * rest * (rest * v0 - s * v1)


@compiled
def crossing(x0, v0, x1, v1, h, target):
    """Fraction of the step at which x, ending beyond target, last passes it; 1 if it does not pass.

    A mover that starts on the target (a rebound) and comes back is caught at its return.
    """
    above = x1 > target
    if above == (x0 > target) and x0 != target:
        return 1.0
    before, after = 0.0, 1.0
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
