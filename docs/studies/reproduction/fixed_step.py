"""The plant's equations with a fixed step, as the report most likely simulated them.

The report used SIMULINK and sampled at 2 kHz. A fixed step of one sample, 0.5 ms, with stops that are
met at the ends of steps, cannot resolve the armature: its flight takes 2 ms and its speed settles
within mMV/kMV = 1 ms. The error moves each flight by a fraction of a step, differently for every value
of mMV, kMV, xMVmax .. and that scatter is most likely what Tables 8 and 9 print for them
(docs/studies/reproduction/README.md).
The method is Dormand and Prince's of order 5 (J. Comput. Appl. Math. 6, 1980), SIMULINK's `ode5`.
"""

from collections.abc import Mapping

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.registry import effect_constants
from epv_env.plant.equations import (
    Inputs,
    State,
    armature_force,
    derivative,
    piston_force,
    reluctance_inverse,
)
from epv_env.plant.lanes import (
    N_STATE,
    coefficients_at,
    effects_at,
    state_at,
    store_state,
)
from epv_env.plant.primitives import FLAGS, inlined, replacing, source_digest
from epv_env.plant.simulate import SimulationError, Trajectory

STAGES = np.array(
    [
        [0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    ]
)
"""Weights of the earlier stages' rates in each stage."""

WEIGHTS = np.array([35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84])
"""Weights of all stages' rates in the step."""


_with_strokes = replacing(State, "xPV", "xMV")
_with_speeds = replacing(State, "vPV", "vMV")


@inlined
def _limited(q, c):
    """The state with both strokes limited; the speeds are left as they are."""
    xPV = min(max(q.xPV, 0.0), c.xPVmax)
    xMV = min(max(q.xMV, 0.0), c.xMVmax)
    return _with_strokes(q, xPV, xMV)


@inlined
def _into_stop(x, v, x_max, direction):
    """Whether a mover on a stop does not leave it and `direction` (a force, a speed) points into it."""
    low = (x <= 0.0) & (v <= 0.0) & (direction < 0.0)
    return low | ((x >= x_max) & (v >= 0.0) & (direction > 0.0))


@inlined
def _rates(q, u, c, effects):
    """Rates of a state with limited strokes; a mover pressed against a stop stands still."""
    force_PV = piston_force(q, c, effects, True)
    force_MV = armature_force(q, c, reluctance_inverse(q, c), effects, True)
    free_PV = 0.0 if _into_stop(q.xPV, q.vPV, c.xPVmax, force_PV) else 1.0
    free_MV = 0.0 if _into_stop(q.xMV, q.vMV, c.xMVmax, force_MV) else 1.0
    q = _with_speeds(q, q.vPV * free_PV, q.vMV * free_MV)
    rates, _, _ = derivative(q, u, c, effects, free_PV, free_MV, True)
    return rates


@inlined
def _landed(q, c):
    """The state at the end of a step: strokes limited, no speed into a stop."""
    q = _limited(q, c)
    vPV = 0.0 if _into_stop(q.xPV, q.vPV, c.xPVmax, q.vPV) else q.vPV
    vMV = 0.0 if _into_stop(q.xMV, q.vMV, c.xMVmax, q.vMV) else q.vMV
    return _with_speeds(q, vPV, vMV)


@inlined
def _moved(y, rates, weights, h, out):
    """out = y + h times the weighted sum of the stages' rates; y, out (states, 1)."""
    for row in range(N_STATE):
        total = 0.0
        for stage in range(weights.size):
            total += weights[stage] * rates[row, stage]
        out[row, 0] = y[row, 0] + h * total


def _compile(digest: str):
    """The kernel; its key in the disk cache changes with the plant's sources."""

    @numba.njit(cache=True, **FLAGS)
    def run(state, coefficient, effect, U, h, record):
        if digest == "":
            return
        rates = np.zeros((N_STATE, WEIGHTS.size))
        y, trial = np.empty((N_STATE, 1)), np.empty((N_STATE, 1))
        for lane in range(state.shape[1]):
            c, effects = coefficients_at(coefficient, 0, lane), effects_at(effect, 0, lane)
            store_state(y, 0, 0, state_at(state, 0, lane))
            for sample in range(U.size):
                record[sample, :, lane] = y[:, 0]
                u = Inputs(U[sample], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
                for stage in range(WEIGHTS.size):
                    _moved(y, rates, STAGES[stage], h, trial)
                    q = _limited(state_at(trial, 0, 0), c)
                    store_state(rates, 0, stage, _rates(q, u, c, effects))
                _moved(y, rates, WEIGHTS, h, trial)
                store_state(y, 0, 0, _landed(state_at(trial, 0, 0), c))

    return run


_run = _compile(source_digest())


def simulate_fixed_step(
    p: Mapping[str, ArrayLike], *, initial: State, U: ArrayLike, period: float
) -> Trajectory:
    """`simulate` for n variants with one step per sample; stops are inelastic and end a step.

    p: parameters by symbol, scalars or arrays (n,). U [V]: (samples,). period: the step [s]. Returns
    fields of shape (samples, n). Raises SimulationError.
    """
    table, effects = coefficients(p), effect_constants(p)
    n = max(table.shape[1], effects.shape[1])
    state = np.array(np.broadcast_arrays(*initial, np.empty(n))[:-1], dtype=float)
    voltage = np.asarray(U, dtype=float)
    record = np.empty((len(voltage), N_STATE, n))
    _run(state, _columns(table, n), _columns(effects, n), voltage, period, record)
    if not np.all(np.isfinite(record)):
        raise SimulationError(f"a fixed step of {period:g} s is unstable here: take a shorter one")
    time = np.arange(len(voltage)) * period
    return Trajectory(time=time, U=voltage, state=State(*record.transpose(1, 0, 2)))


def _columns(table: NDArray, n: int) -> NDArray:
    """The table with a column per variant."""
    return np.ascontiguousarray(np.broadcast_to(table, (len(table), n)))
