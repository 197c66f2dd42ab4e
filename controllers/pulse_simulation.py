"""Making a pulse table: some ten thousand short simulations of a plant in one batch."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from controllers.opening_pressure import opening_pressure
from controllers.pulse_table import GRID, PulseTable, PulseTables
from epv_env.common.units import BAR
from epv_env.plant.equations import State
from epv_env.plant.plantfile import Plant
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves


@dataclass(frozen=True, kw_only=True)
class PulseSimulation:
    """How the pulses of a table are simulated."""

    time_step: float = 5e-3
    """Time step in which the valves are watched until they have shut [s]."""
    most_steps: int = 60
    """Steps after which a valve counts as one that does not shut."""
    held_volume: float = 1e9
    """Factor of the circuit's volume that holds its pressure while the control chamber vents [1]."""
    venting_times: tuple[float, float, float] = (0.0, 20e-3, 40e-3)
    """Start, and two later times between which the control chamber's venting rate is taken [s]."""


SIMULATION = PulseSimulation()


def pulse_table(
    p: Mapping[str, float], *, supply_voltage: float = 24.0, settings: PulseSimulation = SIMULATION
) -> PulseTable:
    """The table of a plant; takes about a third of a second.

    Args:
        p: parameters by symbol.
        supply_voltage: of the coil when on [V].
        settings: of the simulations.

    Raises:
        ValueError: some valve stays open after the coil is switched on.
    """
    vent_rate, release_lag = _venting(p, supply_voltage, settings)
    p1, ratio = (axis.ravel() for axis in np.meshgrid(GRID.supply, GRID.ratio, indexing="ij"))
    under_way = _vented(p, p1, ratio * p1, supply_voltage, settings)
    left_off = _record(p, under_way, GRID.stay)
    p2, shutting = _shut_again(p, left_off, supply_voltage, settings)
    supplies, ratios, ages, stays = GRID.shape

    def on_grid(values: NDArray) -> NDArray:
        return np.moveaxis(values.reshape(ages, supplies, ratios, stays), 0, 2)

    return PulseTable(
        parameters=p, vent_rate=vent_rate, release_lag=release_lag,
        gain=on_grid((p2 - left_off.p2[:, :1]) / BAR), lasts=on_grid(GRID.stay + shutting),
    )  # fmt: skip


def nominal_table(plant: Plant) -> PulseTable:
    """The table that a controller of this nominal plant starts from. A plant's table is made once."""
    return _cached_table(tuple(plant.parameters.items()), plant.voltage)


def pulse_tables(plants: Sequence[Mapping[str, float]], supply_voltage: float = 24.0) -> PulseTables:
    """The tables of n plants (parameters by symbol), in their order. A plant's table is made once.

    supply_voltage: of their coils when on [V].
    """
    tables = [_cached_table(tuple(plant.items()), supply_voltage) for plant in plants]
    return PulseTables(
        parameters={s: np.array([plant[s] for plant in plants]) for s in plants[0]},
        vent_rate=np.array([table.vent_rate for table in tables]),
        release_lag=np.array([table.release_lag for table in tables]),
        gain=np.array([table.gain for table in tables]),
        lasts=np.array([table.lasts for table in tables]),
    )


@lru_cache(maxsize=1024)
def _cached_table(plant: tuple[tuple[str, float], ...], supply_voltage: float) -> PulseTable:
    """The table of a plant. Searches, lessons and evaluations meet the same plants again and again."""
    return pulse_table(dict(plant), supply_voltage=supply_voltage)


def _valves(p: Mapping[str, float], state: State, U: float) -> Valves:
    """Valves in the given state (fields that broadcast to (n,)) under a constant voltage [V]."""
    valves = Valves(np.size(state.p2))
    valves.set_parameters(np.arange(valves.n), p)
    for field, value in zip(valves.state, state, strict=True):
        field[:] = value
    valves.inputs.U[:] = U
    return valves


def _record(p: Mapping[str, float], state: State, times: NDArray) -> State:
    """States at `times` [s], the first being 0, with the coil off; fields (n, times)."""
    valves = _valves(p, state, 0.0)
    periods = np.diff(times)[:, None]
    later = valves.record(valves.inputs._replace(U=np.zeros_like(periods)), periods)
    return State(
        *(
            np.concatenate([np.broadcast_to(first, (1, valves.n)), rest]).T
            for first, rest in zip(state, later, strict=True)
        )
    )


def _venting(p: Mapping[str, float], U: float, settings: PulseSimulation) -> tuple[float, float]:
    """Rate of ln p3 with the coil off [1/s], and the armature's lag before it falls [s]."""
    p1 = GRID.supply[1:2]
    times = np.array(settings.venting_times)
    start = energised(p, p1=p1, p2=GRID.ratio[3] * p1, U=U)
    logs = np.log(_record(p, start, times).p3[0])
    rate = (logs[1] - logs[2]) / (times[2] - times[1])
    return float(rate), float(times[1] - (logs[0] - logs[1]) / rate)


def _vented(
    p: Mapping[str, float], p1: NDArray, p2: NDArray, U: float, settings: PulseSimulation
) -> State:
    """States at the ages of a pulse under way that has not raised p2 yet; fields (ages n,).

    p1, p2: (n,) [Pa].
    """
    start = energised(p, p1=p1, p2=p2, U=U)
    p3 = GRID.start_ratio * opening_pressure(p, p1, p2)
    released = start._replace(p3=p3, xMV=0.0, I=0.0, I_coil=0.0)
    under_way = _record({**p, "V2": settings.held_volume * p["V2"]}, released, GRID.age)
    return State(*(field.T.ravel() for field in under_way))


def _shut_again(
    p: Mapping[str, float], state: State, U: float, settings: PulseSimulation
) -> tuple[NDArray, NDArray]:
    """After switching on in states (n, stay): p2 once the valve has shut [Pa], and when that is [s].

    Both (n, stay); the time is known to within half a time step. Raises ValueError for a plant that
    stays open.
    """
    valves = _valves(p, State(*(field.ravel() for field in state)), U)
    step, shutting = settings.time_step, np.zeros(valves.n)
    for _ in range(settings.most_steps):
        valves.advance(step)
        still_open = valves.state.xPV > 0
        shutting += np.where(still_open, step, 0.0)
        if not np.any(still_open):
            return valves.state.p2.reshape(state.p2.shape), shutting.reshape(state.p2.shape) + step / 2
    raise ValueError(
        f"a pulse cannot be planned: {settings.most_steps * step:g} s after switching on with {U:g} V "
        "some valve is still open; check the plant's parameters"
    )
