"""Lookup table of a pulse: how far does p2 rise if the coil stays off for this long?

While the coil is off the control chamber vents through its exhaust: ln p3 falls at one constant rate
while the exhaust is choked, and more slowly below 1.9 times the ambient pressure. The measured p3
therefore says how far a pulse has come, whatever p3 it began at. One table serves pulses from rest,
pulses in quick succession and a valve that begins wide open: the rise of p2 as a function of p1, p2/p1,
the age of the venting (since p3 stood 5 % above the opening pressure) and the time that the coil stays
off. Some ten thousand short simulations of the plant in one batch make the table.

All functions that are compiled take numbers in bar and seconds, so that they can be translated to C.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from controllers.base import compiled
from epv_env.common.units import BAR, GRAM, MILLISECOND
from epv_env.plant.consumption import SCENARIOS
from epv_env.plant.equations import State
from epv_env.plant.plantfile import Plant
from epv_env.plant.primitives import CRITICAL_RATIO, QUARTER_PI, bracket_over_drop
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves

SUPPLY = np.array([7.0, 11.0, 15.0])
"""Nodes of p1 [bar]; beyond the ends of an axis its end holds."""
RATIO = np.array([0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98])
"""Nodes of p2/p1 [1]; denser where the flow falls steeply with the ratio."""
AGE = np.array([*range(0, 26, 2), 30, 40, 50, 70, 100, 150, 200, 300]) * MILLISECOND
"""Nodes of the venting's age [s]; after the last one the chamber is empty."""
STAY = np.array([*range(0, 30, 2), 35, 40, 50, 70, 100]) * MILLISECOND
"""Nodes of the time that the coil stays off [s]."""
START_RATIO = 1.05
"""p3 over the opening pressure at age zero [1]: the valve stays shut for some milliseconds more."""
HARDEST_FLOW = SCENARIOS["emergency"].flow[1] * GRAM
"""Flow of the hardest application [kg/s]."""

TIME_STEP, MOST_STEPS = 5e-3, 60
"""Time step in which simulated valves are watched until they have shut [s]; steps after which a valve
counts as one that does not shut."""

LEAST_RATIO, MOST_RATIO, RATIOS = 1.002, 50.0, 512
"""Chamber pressures over the ambient one for which venting times are tabulated [1], and their number."""


class PulseTable(NamedTuple):
    """What p2 gains by leaving the coil off for a while, of m plants. Bar and seconds."""

    seat_ratio: NDArray
    """Area of the seat over that of the piston (m,) [1]."""
    spring: NDArray
    """Force of the spring on the shut piston over its area (m,) [bar]."""
    ambient: NDArray
    """Pressure that the control chamber vents to (m,) [bar]."""
    vent_rate: NDArray
    """-d ln(p3)/dt while the coil is off and the exhaust is choked (m,) [1/s]."""
    release_lag: NDArray
    """From switching off to the control chamber's venting (m,) [s]."""
    hardest_fall: NDArray
    """Fall of p2 by the hardest application (m,) [bar/s]."""
    gain: NDArray
    """p2 added until the valve has shut again [bar], (m, supply, ratio, age, stay)."""
    lasts: NDArray
    """From now until the valve has shut again [s]; the same shape."""


def relative_flux(ratio: NDArray) -> NDArray:
    """Flux out of a chamber over its choked flux (report eq. 13, 14), (n,) [1].

    ratio: pressure over the one behind the orifice (n,) [1]; 1.002 at least counts.
    """
    choked = 1 - CRITICAL_RATIO
    drop = np.minimum(1 - 1 / np.maximum(ratio, LEAST_RATIO), choked)
    return np.sqrt(bracket_over_drop(drop) * drop / (bracket_over_drop(np.array(choked)) * choked))


_LOGS = np.linspace(np.log(LEAST_RATIO), np.log(MOST_RATIO), RATIOS)
_FINE = np.linspace(_LOGS[0], _LOGS[-1], 16 * (RATIOS - 1) + 1)
VENTING_TIME = cumulative_trapezoid(1 / relative_flux(np.exp(_FINE)), _FINE, initial=0.0)[::16].copy()
"""Time of venting to the ambient pressure from each ratio, times the choked rate [1]."""
_FIRST_LOG, _LOG_STEP = float(_LOGS[0]), float(_LOGS[1] - _LOGS[0])


@compiled
def venting_time(ratio):
    """Time of venting from a pressure to the ambient one, times the choked rate k [1].

    While the exhaust is choked the pressure falls at a constant rate k = -d ln(p)/dt, and below the
    critical ratio at k flux(p) / choked flux(p). ratio: pressure over the ambient one, absolute [1].
    """
    # The limits come first: of a limit and NaN, min and max return the limit, here and in C.
    place = (np.log(min(MOST_RATIO, max(LEAST_RATIO, ratio))) - _FIRST_LOG) / _LOG_STEP
    node = min(int(place), RATIOS - 2)
    share = place - node
    return VENTING_TIME[node] * (1 - share) + VENTING_TIME[node + 1] * share


@compiled
def opens_at(table, t, p1, p2):
    """p3 below which the valve opens [bar]: the piston's balance at rest (report eq. 22)."""
    return p1 - (p1 - p2) * table.seat_ratio[t] - table.spring[t]


@compiled
def venting_age(table, t, offset, p1, p2, p3):
    """Time since p3 stood at START_RATIO times the opening pressure [s]; negative: it is yet to come.

    offset: of the opening pressure from the table's [bar].
    """
    opening = opens_at(table, t, p1, p2) + offset
    start = START_RATIO * max(opening, 1.0) / table.ambient[t]
    return (venting_time(start) - venting_time(p3 / table.ambient[t])) / table.vent_rate[t]


@compiled
def time_to_open(table, t, offset, p1, p2, p3):
    """Time with the coil off until p3 passes the opening pressure [s]; negative: it has."""
    return np.log(START_RATIO) / table.vent_rate[t] - venting_age(table, t, offset, p1, p2, p3)


@compiled
def place(axis, value):
    """The node below a value, and how far beyond it the value is, as a share of the interval."""
    node = 0
    for k in range(1, len(axis) - 1):
        if value >= axis[k]:
            node = k
    share = (value - axis[node]) / (axis[node + 1] - axis[node])
    return node, min(1.0, max(0.0, share))  # 0 of NaN


@compiled
def cell_of(p1, p2, age):
    """The table's cell on the axes supply, ratio and age: nodes and shares."""
    i, x = place(SUPPLY, p1)
    j, y = place(RATIO, p2 / p1)
    k, z = place(AGE, age)
    return i, j, k, x, y, z


@compiled
def within(values, t, cell, stay):
    """`gain` or `lasts` of plant t within a cell, at a node of stay."""
    i, j, k, x, y, z = cell
    total = 0.0
    for a in range(2):
        for b in range(2):
            for c in range(2):
                weight = (x if a else 1 - x) * (y if b else 1 - y) * (z if c else 1 - z)
                total += weight * values[t, i + a, j + b, k + c, stay]
    return total


@compiled
def gained_at_once(table, t, offset, p1, p2, p3):
    """What p2 still rises if the coil is switched on now [bar]."""
    age = venting_age(table, t, offset, p1, p2, p3)
    return within(table.gain, t, cell_of(p1, p2, age), 0)


@compiled
def change(table, t, cell, age, slope, stay):
    """Change of p2 until the valve has shut, if the coil stays off until a node of stay [bar]."""
    lasts = within(table.lasts, t, cell, stay) - min(age, 0.0)
    return within(table.gain, t, cell, stay) + slope * lasts


@compiled
def duration(table, t, offset, p1, p2, p3, asked, slope):
    """How long the coil must stay off to change p2 by `asked` [bar] until the valve has shut [s].

    slope: of p2 by consumption [bar/s].
    Zero where more than that is under way already; at most the table's end, long past opening.
    """
    age = venting_age(table, t, offset, p1, p2, p3)
    cell = cell_of(p1, p2, age)
    if asked <= change(table, t, cell, age, slope, 0):
        return 0.0
    # Before the valve opens the curve only falls, below its first value: beyond that it is monotone.
    node = 0
    for k in range(1, len(STAY) - 1):
        if change(table, t, cell, age, slope, k) < asked:
            node = k
    low = change(table, t, cell, age, slope, node)
    high = change(table, t, cell, age, slope, node + 1)
    share = min(max((asked - low) / (high - low), 0.0), 1.0) if high > low else 1.0
    return STAY[node] * (1 - share) + STAY[node + 1] * share - min(age, 0.0)


def pulse_table(p: Mapping[str, float], *, supply_voltage: float = 24.0) -> PulseTable:
    """The table of a plant; takes about a third of a second.

    Args:
        p: parameters by symbol.
        supply_voltage: of the coil when on [V].

    Raises:
        ValueError: some valve stays open after the coil is switched on.
    """
    vent_rate, release_lag = _venting(p, supply_voltage)
    p1, ratio = (axis.ravel() for axis in np.meshgrid(SUPPLY * BAR, RATIO, indexing="ij"))
    under_way = _vented(p, p1, ratio * p1, supply_voltage)
    left_off = _record(p, under_way, STAY)
    p2, shutting = _shut_again(p, left_off, supply_voltage)

    def on_grid(values: NDArray) -> NDArray:
        shaped = values.reshape(len(AGE), len(SUPPLY), len(RATIO), len(STAY))
        return np.ascontiguousarray(np.moveaxis(shaped, 0, 2))[None]

    piston, seat = QUARTER_PI * p["d1"] ** 2, QUARTER_PI * p["d2"] ** 2
    numbers = (
        seat / piston, p["cPV"] * p["xPV0"] / piston / BAR, p["p_env"] / BAR, vent_rate, release_lag,
        HARDEST_FLOW * p["R_gas"] * p["T_env"] / p["V2"] / BAR,
    )  # fmt: skip
    return PulseTable(
        *(np.array([number]) for number in numbers),
        gain=on_grid((p2 - left_off.p2[:, :1]) / BAR), lasts=on_grid(STAY + shutting),
    )  # fmt: skip


def nominal_table(plant: Plant) -> PulseTable:
    """The table that a controller of this nominal plant starts from. A plant's table is made once."""
    return pulse_tables([plant.parameters], plant.voltage)


def pulse_tables(plants: Sequence[Mapping[str, float]], supply_voltage: float = 24.0) -> PulseTable:
    """The table of m plants (parameters by symbol), in their order. A plant's table is made once.

    supply_voltage: of their coils when on [V].
    """
    tables = [_cached_table(tuple(plant.items()), supply_voltage) for plant in plants]
    return PulseTable(*(np.concatenate(parts) for parts in zip(*tables, strict=True)))


@lru_cache(maxsize=1024)  # searches and evaluations meet the same plants again and again
def _cached_table(plant: tuple[tuple[str, float], ...], supply_voltage: float) -> PulseTable:
    return pulse_table(dict(plant), supply_voltage=supply_voltage)


def opening_pressure(p: Mapping[str, float], p1: NDArray, p2: NDArray) -> NDArray:
    """Control pressure p3 below which the protection valve opens (n,) [Pa absolute] (report eq. 22).

    Args:
        p: parameters by symbol.
        p1: supply pressure (n,) [Pa absolute].
        p2: circuit pressure (n,) [Pa absolute].
    """
    piston, seat = QUARTER_PI * p["d1"] ** 2, QUARTER_PI * p["d2"] ** 2
    return p1 - ((p1 - p2) * seat + p["cPV"] * p["xPV0"]) / piston


def _valves(p: Mapping[str, float], state: State, U_coil: float) -> Valves:
    """Valves in the given state (fields that broadcast to (n,)) under a constant voltage [V]."""
    valves = Valves.started(np.size(state.p2), p, state)
    valves.inputs.U[:] = U_coil
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


def _venting(p: Mapping[str, float], U_supply: float) -> tuple[float, float]:
    """Rate of ln p3 with the coil off [1/s], and the armature's lag before it falls [s]."""
    p1, times = SUPPLY[1:2] * BAR, np.array([0.0, 20e-3, 40e-3])
    start = energised(p, p1=p1, p2=RATIO[3] * p1, U=U_supply)
    logs = np.log(_record(p, start, times).p3[0])
    rate = (logs[1] - logs[2]) / (times[2] - times[1])
    return float(rate), float(times[1] - (logs[0] - logs[1]) / rate)


def _vented(p: Mapping[str, float], p1: NDArray, p2: NDArray, U_supply: float) -> State:
    """States at the ages of a pulse under way that has not raised p2 yet; fields (ages n,).

    p1, p2: (n,) [Pa].
    """
    start = energised(p, p1=p1, p2=p2, U=U_supply)
    p3 = START_RATIO * opening_pressure(p, p1, p2)
    released = start._replace(p3=p3, xMV=0.0, I=0.0, I_coil=0.0)
    # A circuit of this volume holds its pressure while the control chamber vents.
    under_way = _record({**p, "V2": 1e9 * p["V2"]}, released, AGE)
    return State(*(field.T.ravel() for field in under_way))


def _shut_again(p: Mapping[str, float], state: State, U_supply: float) -> tuple[NDArray, NDArray]:
    """After switching on in states (n, stay): p2 once the valve has shut [Pa], and when that is [s].

    Both (n, stay); the time is known to within half a time step. Raises ValueError for a plant that
    stays open.
    """
    valves = _valves(p, State(*(field.ravel() for field in state)), U_supply)
    shutting = np.zeros(valves.n)
    for _ in range(MOST_STEPS):
        valves.advance(TIME_STEP)
        still_open = valves.state.xPV > 0
        shutting += np.where(still_open, TIME_STEP, 0.0)
        if not np.any(still_open):
            shape = state.p2.shape
            return valves.state.p2.reshape(shape), shutting.reshape(shape) + TIME_STEP / 2
    raise ValueError(
        f"a pulse cannot be planned: {MOST_STEPS * TIME_STEP:g} s after switching on with {U_supply:g} "
        "V some valve is still open; check the plant's parameters"
    )
