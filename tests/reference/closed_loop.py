"""Random closed-loop runs: a simple controller drives the plant; what it did becomes Schedules."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters, table
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves
from tests.reference.hybrid_automaton import Schedule, piecewise_schedule

PERIOD = 5e-3
"""Time between decisions [s]."""
DURATION = 1.0
LOOK_AHEAD = 0.02
"""Time by which the controller extrapolates p2 [s]."""
U_ON = 24.0
VARIED = ("alphaMV", "alphaPV", "RML", "R", "V3", "cPV", "mMV", "kMV", "dMVin")
"""Parameters drawn within 5 % of Table 12's plant (as far as their domain allows)."""


@dataclass(frozen=True, kw_only=True)
class Disturbances:
    """What a scenario imposes, one value per decision, shape (decisions, valves). SI units."""

    target: NDArray
    sigma_S: NDArray
    p1_slope: NDArray


def _steps(rng: np.random.Generator, low: float, high: float, decisions: int, n: int) -> NDArray:
    """Piecewise constant values that change about four times a run."""
    values = rng.uniform(low, high, (decisions, n))
    changes = rng.random((decisions, n)) < 4 / decisions
    changes[0] = True
    last = np.maximum.accumulate(np.where(changes, np.arange(decisions)[:, None], 0), axis=0)
    return np.take_along_axis(values, last, axis=0)


def _drawn_parameters(rng: np.random.Generator) -> Parameters:
    calibrated = Parameters.calibrated()
    values = {}
    for symbol in VARIED:
        low, high = table()[symbol].domain or (-np.inf, np.inf)
        values[symbol] = min(max(calibrated[symbol] * rng.uniform(0.95, 1.05), low), high)
    restitution = rng.choice([0.0, 0.0, 0.5])
    return calibrated.replace(**values, eMV=restitution, ePV=restitution)


def random_schedules(n: int, seed: int) -> list[Schedule]:
    """n different valves, each under extrapolating hysteresis control in a scenario of its own."""
    rng = np.random.default_rng(seed)
    decisions = round(DURATION / PERIOD)
    parameters = [_drawn_parameters(rng) for _ in range(n)]
    p1 = rng.uniform(9e5, 13e5, n)
    imposed = Disturbances(
        target=_steps(rng, 6e5, 8.5e5, decisions, n),
        sigma_S=_steps(rng, -4e-3, 4e-3, decisions, n).clip(0.0),
        p1_slope=_steps(rng, -2e6, 2e6, decisions, n) * (rng.random((decisions, n)) < 0.05),
    )
    initial = [energised(p, p1=at, p2=6.5e5, U=U_ON) for p, at in zip(parameters, p1, strict=True)]
    U = _controlled(parameters, initial, imposed)
    borders = np.arange(decisions + 1) * PERIOD
    return [
        piecewise_schedule(
            parameters[k], initial[k], borders, U=U[:, k], sigma_S=imposed.sigma_S[:, k],
            p1_slope=imposed.p1_slope[:, k],
        )
        for k in range(n)
    ]  # fmt: skip


def _controlled(parameters: list[Parameters], initial: list[State], imposed: Disturbances) -> NDArray:
    """Voltages that the controller chooses [V], shape (decisions, valves)."""
    n = len(parameters)
    every = {key: np.array([p[key] for p in parameters]) for key in parameters[0]}
    valves = Valves.started(n, every, State(*zip(*initial, strict=True)), threads=1)
    U = np.full(imposed.target.shape, U_ON)
    previous = valves.state.p2.copy()
    for k, target in enumerate(imposed.target):
        expected = valves.state.p2 + (valves.state.p2 - previous) * (LOOK_AHEAD / PERIOD)
        shut = np.where(U[k - 1] > 0, expected > target - 0.1e5, expected > target)
        U[k] = np.where(shut, U_ON, 0.0)
        previous = valves.state.p2.copy()
        valves.inputs.U[:] = U[k]
        valves.inputs.sigma_S[:] = imposed.sigma_S[k]
        valves.inputs.p1_slope[:] = imposed.p1_slope[k]
        valves.advance(PERIOD)
    return U
