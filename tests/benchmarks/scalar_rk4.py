"""For comparison: a compiled scalar Runge-Kutta simulator without any refinement.

Classical Runge-Kutta at 50 us, both powers of eq. 13 in every flow, movers put back on their stops
after each step. Same equations, same compiler.
"""

from math import pi, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from epv_env.plant.primitives import LAMINAR_DROP
from identification.bench.hybrid_automaton import Schedule

STEP = 50e-6
SYMBOLS = (
    "kappa", "mu0", "R_gas", "T_env", "p_env", "cMV", "cPV", "d1", "d2", "dMB", "dMVin", "dMVexh",
    "mMV", "mPV", "N", "R", "V2", "V3", "xMV0", "xMVmax", "xPV0", "alphaMV", "alphaPV",
    "kMV", "kPV", "RML",
)  # fmt: skip


@numba.njit(fastmath=True)
def _flux(p_a, p_b, kappa, RT):
    up, down = max(p_a, p_b), min(p_a, p_b)
    r = max(down / up, (2 / (kappa + 1)) ** (kappa / (kappa - 1)))
    bracket = r ** (2 / kappa) - r ** ((kappa + 1) / kappa)
    flux = up * sqrt(2 * kappa / ((kappa - 1) * RT) * bracket * min((1 - r) / LAMINAR_DROP, 1.0))
    return flux if p_a > p_b else -flux


@numba.njit(fastmath=True)
def _rates(y, U, sigma_S, p1, p, out):
    (kappa, mu0, R_gas, T_env, p_env, cMV, cPV, d1, d2, dMB, dMVin, dMVexh, mMV, mPV, N, R, V2, V3,
     xMV0, xMVmax, xPV0, alphaMV, alphaPV, kMV, kPV, RML) = p  # fmt: skip
    p2, p3, xPV, vPV, xMV, vMV, I = y  # noqa: E741
    RT = R_gas * T_env
    A_MB = pi / 4 * dMB**2
    Rm = RML + (xMVmax - xMV) / (mu0 * A_MB)
    A_in = min(pi * dMVin * xMV, pi / 4 * dMVin**2)
    A_exh = min(pi * dMVexh * (xMVmax - xMV), pi / 4 * dMVexh**2)
    inlet = alphaMV * A_in * _flux(p1, p3, kappa, RT)
    exhaust = alphaMV * A_exh * _flux(p3, p_env, kappa, RT)
    out[0] = RT / V2 * (alphaPV * d2 * pi * xPV * _flux(p1, p2, kappa, RT) - sigma_S)
    out[1] = RT / V3 * (inlet - exhaust)
    force = pi / 4 * (p1 * (d1**2 - d2**2) + p2 * d2**2 - p3 * d1**2)
    out[2] = vPV
    out[3] = (force - cPV * (xPV + xPV0) - kPV * vPV) / mPV
    out[4] = vMV
    magnetic = N**2 * I**2 / (2 * Rm**2 * mu0 * A_MB)
    out[5] = (magnetic - cMV * (xMV + xMV0) - kMV * vMV) / mMV
    out[6] = (U - R * I) * Rm / N**2 - I * vMV / (Rm * mu0 * A_MB)


@numba.njit(fastmath=True)
def _moved(y, h, k, out):
    for i in range(7):
        out[i] = y[i] + h * k[i]


@numba.njit(fastmath=True)
def _run(y, U, sigma_S, p1, duration, step, p, xPVmax, xMVmax):
    k1, k2, k3, k4, there = np.empty(7), np.empty(7), np.empty(7), np.empty(7), np.empty(7)
    for _ in range(round(duration / step)):
        _rates(y, U, sigma_S, p1, p, k1)
        _moved(y, step / 2, k1, there)
        _rates(there, U, sigma_S, p1, p, k2)
        _moved(y, step / 2, k2, there)
        _rates(there, U, sigma_S, p1, p, k3)
        _moved(y, step, k3, there)
        _rates(there, U, sigma_S, p1, p, k4)
        for i in range(7):
            y[i] += step / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i])
        for x, limit in ((2, xPVmax), (4, xMVmax)):
            if y[x] <= 0.0:
                y[x], y[x + 1] = 0.0, max(y[x + 1], 0.0)
            elif y[x] >= limit:
                y[x], y[x + 1] = limit, min(y[x + 1], 0.0)


def run_scalar_rk4(schedule: Schedule, step: float = STEP) -> NDArray:
    """The seven states at the end of a schedule at constant supply pressure [SI], (7,). step: [s]."""
    values = schedule.parameters
    p = tuple(float(values[symbol]) for symbol in SYMBOLS)
    y = np.array(schedule.initial[:7], dtype=float)
    limits = values["xPVmax"], values["xMVmax"]
    u = schedule.inputs
    for k, duration in enumerate(np.diff(schedule.borders)):
        _run(y, u.U[k], u.sigma_S[k], schedule.initial.p1, duration, step, p, *limits)
    return y
