"""The plant's state equations for one valve as a compiled function of arrays."""

from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

from epv_env.plant.effects.coil import coil_current
from epv_env.plant.equations import derivative
from epv_env.plant.lanes import coefficients_at, effects_at, inputs_at, state_at, store_state
from epv_env.plant.primitives.compiled import FLAGS, source_digest

RightHandSide = Callable[[NDArray, NDArray, NDArray, NDArray, float, float], NDArray]
"""(state, inputs, coefficients, effects, free_PV, free_MV) -> rates and both forces."""

TerminalCurrents = Callable[[float, NDArray, NDArray, NDArray, NDArray], NDArray]
"""(voltage, state I, state coil_heat, coefficients, effects) -> currents."""


# Closed over by the compiled functions: a change of any inlined source changes their key in the cache.
_DIGEST = source_digest(Path(__file__))


def _terminal_currents(digest: str) -> TerminalCurrents:
    @numba.njit(cache=True, **FLAGS)
    def terminal_currents(U, current, coil_heat, coefficients, effects):
        out = np.empty_like(current)
        if digest == "":  # keeps the digest in the closure
            return out
        c, e = coefficients_at(coefficients, 0, 0), effects_at(effects, 0, 0)
        for k in range(current.size):
            out[k] = coil_current(U, current[k], c.R, coil_heat[k], e)
        return out

    return terminal_currents


terminal_currents = _terminal_currents(_DIGEST)
"""Currents at the coil's terminals, (samples,) [A].

U: coil voltage [V]. current: state I, (samples,) [A]. coil_heat: state, (samples,) [K].
coefficients, effects: tables of one valve, as epv_env.plant.coefficients makes them.
"""


def compiled_right_hand_side(extended: bool, digest: str = _DIGEST) -> RightHandSide:
    """`derivative` for one valve as a compiled function of arrays."""

    @numba.njit(cache=True, **FLAGS)
    def rates_and_forces(y, u, c, e, free_PV, free_MV):
        if digest == "":
            return np.zeros(0)
        q = state_at(y.reshape(-1, 1), 0, 0)
        inputs = inputs_at(u.reshape(-1, 1), 0, 0)
        rates, force_PV, force_MV = derivative(
            q, inputs, coefficients_at(c, 0, 0), effects_at(e, 0, 0), free_PV, free_MV, extended
        )
        out = np.empty(y.size + 2)
        store_state(out.reshape(-1, 1), 0, 0, rates)
        out[-2], out[-1] = force_PV, force_MV
        return out

    return rates_and_forces


COMPILED_RIGHT_HAND_SIDES = {extended: compiled_right_hand_side(extended) for extended in (False, True)}
"""Compiled on first use."""
