"""Library integrators without events at the stops. Their results are wrong."""

import warnings
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.registry import effect_constants
from epv_env.plant.equations import Inputs
from identification.bench.hybrid_automaton import COMPILED_RIGHT_HAND_SIDES, POSITIONS, Schedule

RTOL, ATOL = 1e-6, 1e-9
MOST_EVALUATIONS = 300_000

NO_STOPS = "no stops"
STROKES = "strokes clipped"
STROKES_AND_RATES = "strokes, speeds, forces clipped"
CLIPS = (NO_STOPS, STROKES, STROKES_AND_RATES)
"""How the right-hand side treats a mover at or beyond a stop: not at all; as if it were on the stop;
and besides without outward speed and acceleration."""


class GaveUpError(RuntimeError):
    """The integrator made no progress."""


def _right_hand_side(schedule: Schedule, u: NDArray, clip: str) -> Callable:
    c, e = coefficients(schedule.parameters), effect_constants(schedule.parameters)
    limits = dict(zip(POSITIONS, (schedule.parameters[s] for s in ("xPVmax", "xMVmax")), strict=True))
    evaluations = 0

    def rates(_t: float, y: NDArray) -> NDArray:
        nonlocal evaluations
        evaluations += 1
        if evaluations > MOST_EVALUATIONS:
            raise GaveUpError(f"no end after {MOST_EVALUATIONS} evaluations")
        inside = np.array(y)
        if clip != NO_STOPS:
            for x, limit in limits.items():
                inside[x] = min(max(y[x], 0.0), limit)
        out = COMPILED_RIGHT_HAND_SIDES[False](inside, u, c, e, 1.0, 1.0)[:-2]
        if clip == STROKES_AND_RATES:
            for x, limit in limits.items():
                if y[x] <= 0:
                    out[x : x + 2] = np.maximum(out[x : x + 2], 0.0)
                elif y[x] >= limit:
                    out[x : x + 2] = np.minimum(out[x : x + 2], 0.0)
        return out

    return rates


def final_p2(schedule: Schedule, method: str, clip: str) -> tuple[float, str]:
    """p2 at the end [Pa], and the reason if there is none (nan).

    The integration starts anew where inputs change, which helps the integrator.
    """
    u = np.zeros(len(Inputs._fields))
    rates = _right_hand_side(schedule, u, clip)
    y = np.array(schedule.initial, dtype=float)
    for k, (start, end) in enumerate(zip(schedule.borders[:-1], schedule.borders[1:], strict=True)):
        u[:] = [field[k] for field in schedule.inputs]
        try:
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                run = solve_ivp(rates, (start, end), y, method=method, rtol=RTOL, atol=ATOL)
        except (GaveUpError, ValueError, np.linalg.LinAlgError) as error:
            return float("nan"), f"fails after {start:g} s: {error}"
        if run.status != 0:
            return float("nan"), f"fails at {run.t[-1]:.3f} s: {run.message}"
        y = run.y[:, -1]
    return float(y[0]), ""
