"""Simulating one valve on given inputs: recordings, tests, figures."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.effects.coil import COPPER
from epv_env.plant.equations import Inputs, State
from epv_env.plant.primitives import CRITICAL_RATIO, LAMINAR_DROP, Value, bracket_over_drop
from epv_env.plant.runge_kutta import DEFAULT_STEP
from epv_env.plant.valves import Valves

BISECTIONS = 40
"""Halvings of the range of p3 in which a leaking valve rests: to 1e-12 of p1."""


class SimulationError(RuntimeError):
    """The integrator gave a valve up; its parameters or inputs are not physical."""


@dataclass(frozen=True, kw_only=True)
class Trajectory:
    """A simulated run; every array has shape (samples,) or, for n valves, (samples, n). SI units."""

    time: NDArray
    """Times of the samples, (samples,) [s]."""
    U: NDArray
    """Solenoid voltage [V]."""
    state: State
    """States; fields of the shape above [SI]."""


def energised(p: Mapping[str, Value], *, p1: Value, p2: Value, U: Value) -> State:
    """Steady state with the coil on: armature pulled in, p3 = p1, PV shut (SI units).

    Arguments are numbers, or arrays (n,) for n valves. An exhaust that leaks keeps p3 below p1; leaks
    into and out of the circuit, which know no steady state, are left out.
    """
    coil = U - np.minimum(p["U_drop"], np.maximum(U, 0.0))
    current = coil / (p["R"] * (1.0 + COPPER * p["theta_coil"]))
    return State(
        p2=p2, p3=_leaking_control_pressure(p, p1), xPV=0.0, vPV=0.0, xMV=p["xMVmax"], vMV=0.0,
        I=current, p1=p1, air_in_PV=0.0, air_in_MV=0.0, air_vented=0.0, coil_energy=0.0,
        I_coil=current, coil_heat=p["theta_coil"], heat_3=0.0, heat_2=0.0, far_pressure=0.0,
        supply_drop=0.0, lag_2=0.0, lag_3=0.0,
    )  # fmt: skip


def _leaking_control_pressure(p: Mapping[str, Value], p1: Value) -> Value:
    """p3 at which the open inlet replaces what the exhaust's seat leaks [Pa], by bisection.

    Both flows per area depend on p3/p1 alone: nothing to do but where a leak chokes, as seats do.
    """
    if not np.any(p["A_exh"]):
        return p1
    inlet = p["alphaMV"] * np.pi * p["dMVin"] * np.minimum(p["xMVmax"], p["dMVin"] / 4)
    low, high = np.zeros(np.broadcast(inlet, p["A_exh"], p1).shape), 1.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        lost = p["A_exh"] * middle * _relative_flux(np.minimum(p["p_env"] / (middle * p1), 1.0))
        enough = inlet * _relative_flux(middle) > lost
        low, high = np.where(enough, middle, low), np.where(enough, high, middle)
    return np.where(np.asarray(p["A_exh"]) > 0, low * p1, p1)


def _relative_flux(ratio: NDArray) -> NDArray:
    """Mass flux over upstream pressure and 1/sqrt(R T) at a pressure ratio (eqs 13, 14) [-]."""
    drop = 1.0 - np.clip(ratio, CRITICAL_RATIO, 1.0 - LAMINAR_DROP)
    laminar = np.minimum((1.0 - ratio) / LAMINAR_DROP, 1.0)
    return np.sqrt(bracket_over_drop(drop) * drop) * laminar


def simulate(
    p: Mapping[str, ArrayLike],
    *,
    initial: State,
    U: ArrayLike,
    period: float,
    sigma_S: ArrayLike = 0.0,
    p1: ArrayLike | None = None,
    reservoir_volume: float = np.inf,
    step: float = DEFAULT_STEP,
) -> Trajectory:
    """Run one valve (or n variants of it at once) through a sampled voltage.

    p: parameters by symbol, scalars or arrays (n,). initial: state at time 0. U [V], sigma_S [kg/s]:
    shape (samples,) or (samples, n); value k holds from sample k to k + 1. p1 [Pa]: recorded supply,
    (samples,), taken linear between samples; None keeps the initial one. period: time between samples
    [s]. Returns the states at the samples, the first being `initial`. Raises SimulationError.
    """
    U = np.asarray(U, dtype=float)
    columns = [np.reshape(x, (-1, 1)) if np.ndim(x) < 2 else np.asarray(x) for x in (U, sigma_S)]
    n = max(np.size(value) for value in (*p.values(), *initial, *(c[0] for c in columns)))
    valves = Valves.started(n, p, initial, reservoir_volume=reservoir_volume, step=step)
    slope = np.zeros((len(U), 1))
    if p1 is not None:
        valves.state.p1[:] = np.asarray(p1)[0]
        slope[:-1, 0] = np.diff(p1) / period
    later = valves.record(Inputs(columns[0], columns[1], slope, np.zeros((1, 1))), period)
    if not np.all(later.p2 > 0):  # false for NaN, too
        raise SimulationError(
            "the plant could not be integrated: check that pressures are positive (an empty circuit "
            "cannot be consumed from) and that parameters lie in their domains"
        )
    state = State(
        *(
            np.concatenate([np.broadcast_to(first, (1, n)), rest[:-1]])
            for first, rest in zip(initial, later, strict=True)
        )
    )
    if n == 1:
        state = State(*(field[:, 0] for field in state))
    return Trajectory(time=np.arange(len(U)) * period, U=U, state=state)
