"""Workloads of the benchmarks: valves switched at random, as an untrained policy switches them."""

import numpy as np

from epv_env.plant.equations import Inputs
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves
from identification.bench.hybrid_automaton import Schedule, piecewise_schedule

PERIOD = 5e-3
"""Time between decisions [s]."""
SWITCHING = 0.15
"""Probability that a valve is switched at a decision."""
P1, P2, U_ON = 12.0e5, 7.0e5, 24.0
"""Supply and circuit pressure at the start [Pa], voltage of the energised coil [V]."""
CALIBRATED = Parameters.calibrated()


def energised_valves(n: int, threads: int, step: float | None = None) -> Valves:
    """n valves at rest with the coil on."""
    valves = Valves(n, threads=threads, **({} if step is None else {"step": step}))
    valves.set_parameters(np.arange(n), CALIBRATED)
    for field, value in zip(valves.state, energised(CALIBRATED, p1=P1, p2=P2, U=U_ON), strict=True):
        field[:] = value
    return valves


def random_switching(n: int, periods: int, seed: int = 0) -> Inputs:
    """Voltage, and a consumption that keeps p2 below p1; fields of shape (periods, n)."""
    rng = np.random.default_rng(seed)
    off = np.cumsum(rng.random((periods, n)) < SWITCHING, axis=0) % 2 == 1
    zeros = np.zeros((periods, n))
    return Inputs(
        U=np.where(off, 0.0, U_ON),
        sigma_S=rng.uniform(0, 4e-3, (1, n)) * np.ones((periods, 1)),
        p1_slope=zeros,
        refill=zeros,
        air_3=zeros,
        force_PV=zeros,
        force_MV=zeros,
    )


def held(n: int, periods: int) -> Inputs:
    """The coil stays on: both movers are held, and every step is twice the default one."""
    zeros = np.zeros((periods, n))
    return Inputs(zeros + U_ON, *[zeros] * 6)


def one_valve(duration: float, seed: int = 0) -> Schedule:
    """One valve of `random_switching` as a Schedule."""
    periods = round(duration / PERIOD)
    u = random_switching(1, periods, seed)
    return piecewise_schedule(
        CALIBRATED,
        energised(CALIBRATED, p1=P1, p2=P2, U=U_ON),
        np.arange(periods + 1) * PERIOD,
        U=u.U[:, 0],
        sigma_S=u.sigma_S[:, 0],
    )
