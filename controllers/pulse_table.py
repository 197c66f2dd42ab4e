"""The calibrated model's answer to: how long must the coil be off to add this much pressure?

While the coil is off the control chamber vents through a choked exhaust, so ln p3 falls at one constant
rate. The measured p3 therefore says how far a pulse has come, whatever p3 it began at, and one table
serves pulses from rest and pulses in quick succession: pressure gained, as a function of p1, p2/p1, the
age of the venting (since p3 stood 5 % above the opening pressure) and the time that the coil stays off.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.opening_pressure import opening_pressure
from epv_env.common.units import BAR
from epv_env.plant.equations import State
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves

SUPPLY = np.array([7.0, 11.0, 15.0]) * BAR
"""Nodes of p1 [Pa]; beyond the ends of an axis its end holds."""
RATIO = np.array([0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98])
"""Nodes of p2/p1."""
AGE = np.concatenate([np.arange(0, 26, 2), [30, 40, 50, 70, 100]]) * 1e-3
"""Nodes of the venting's age [s]."""
STAY = np.concatenate([np.arange(0, 30, 2), [35, 40, 50, 70, 100]]) * 1e-3
"""Nodes of the time that the coil stays off [s]."""
ABOVE = 1.05
"""p3 over the opening pressure at age zero: the valve is shut and will be for some milliseconds."""
WATCH = 5e-3
"""Time step in which the table's valves are watched until they have shut [s]."""
PATIENCE = 60
"""Such steps after which a valve counts as one that does not shut."""
HELD_VOLUME = 1e9
"""Volume that makes a chamber's pressure stand still, as a factor."""


@dataclass(frozen=True, kw_only=True)
class PulseTable:
    """What p2 gains by leaving the coil off for a while. Bar and seconds.

    Arguments of the methods are arrays (n,): measured p1, p2, p3 [bar absolute] with the coil off. Each
    valve's answer is the same to the bit whatever n.
    """

    parameters: Mapping[str, Any]
    vent_rate: float | NDArray
    """-d ln(p3)/dt while the coil is off [1/s]."""
    release_lag: float | NDArray
    """From switching off to the control chamber's venting [s]."""
    gain: NDArray
    """p2 added until the valve has shut again [bar]; shape of the axes SUPPLY, RATIO, AGE, STAY."""
    lasts: NDArray
    """From now until the valve has shut again [s]; the same shape."""

    def venting_age(self, p1: NDArray, p2: NDArray, p3: NDArray) -> NDArray:
        """How long ago p3 stood at ABOVE times the opening pressure [s]; negative: it is yet to come."""
        opening = opening_pressure(self.parameters, p1 * BAR, p2 * BAR) / BAR
        return np.log(ABOVE * np.maximum(opening, 1.0) / p3) / self.vent_rate

    def time_to_open(self, p1: NDArray, p2: NDArray, p3: NDArray) -> NDArray:
        """Time with the coil off until p3 passes the opening pressure [s]; negative: it has."""
        return np.log(ABOVE) / self.vent_rate - self.venting_age(p1, p2, p3)

    def gained(
        self, p1: NDArray, p2: NDArray, p3: NDArray, stay: NDArray, slope: NDArray | float = 0.0
    ) -> NDArray:
        """Change of p2 until the valve has shut, if the coil stays off for `stay` (n,) [s] [bar].

        slope: of p2 by consumption [bar/s], a number or (n,). A stay that ends before age zero adds
        nothing and counts as one until then.
        """
        age = self.venting_age(p1, p2, p3)
        curve = self._curve(p1, p2, age, slope)
        node, share = _place(STAY, stay + np.minimum(age, 0.0))
        row = np.arange(len(curve))
        return curve[row, node] * (1 - share) + curve[row, node + 1] * share

    def duration(
        self, p1: NDArray, p2: NDArray, p3: NDArray, asked: NDArray, slope: NDArray | float = 0.0
    ) -> NDArray:
        """The inverse of `gained`: how long the coil must stay off to change p2 by `asked` (n,) [s].

        Zero where more than that is under way already; at most the table's end, long past opening.
        """
        age = self.venting_age(p1, p2, p3)
        curve = self._curve(p1, p2, age, slope)
        # Before the valve opens the curve only falls, below its first value: beyond that it is monotone.
        node = np.clip(np.sum(curve < asked[:, None], axis=1) - 1, 0, len(STAY) - 2)
        row = np.arange(len(curve))
        low, high = curve[row, node], curve[row, node + 1]
        share = np.clip((asked - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)
        stay = STAY[node] * (1 - share) + STAY[node + 1] * share
        return np.where(asked > curve[:, 0], stay - np.minimum(age, 0.0), 0.0)

    def _curve(self, p1: NDArray, p2: NDArray, age: NDArray, slope: NDArray | float) -> NDArray:
        """Change of p2 over STAY (n, STAY), linear between the nodes of the other axes."""
        axes = ((SUPPLY, p1 * BAR), (RATIO, p2 / p1), (AGE, age))
        places = [_place(axis, value) for axis, value in axes]
        gain, lasts = np.zeros((2, len(p1), len(STAY)))
        for corner in np.ndindex(2, 2, 2):
            weight = np.ones(len(p1))
            for (_, share), upper in zip(places, corner, strict=True):
                weight = weight * (share if upper else 1 - share)
            nodes = tuple(node + upper for (node, _), upper in zip(places, corner, strict=True))
            gain += weight[:, None] * self._rows(self.gain, nodes)
            lasts += weight[:, None] * self._rows(self.lasts, nodes)
        return gain + np.reshape(slope, (-1, 1)) * (lasts - np.minimum(age, 0.0)[:, None])

    def _rows(self, table: NDArray, nodes: tuple[NDArray, ...]) -> NDArray:
        """The table's rows (n, STAY) at nodes (n,) of the other axes."""
        return table[nodes]


class PulseTables(PulseTable):
    """A table for each of n valves: arrays with a first axis (n,), parameters (n,) by symbol."""

    @classmethod
    def of(cls, plants: Sequence[Mapping[str, float]]) -> "PulseTables":
        """The tables of these plants, in their order."""
        tables = [_table_met_before(tuple(plant.items())) for plant in plants]
        return cls(
            parameters={s: np.array([plant[s] for plant in plants]) for s in plants[0]},
            vent_rate=np.array([table.vent_rate for table in tables]),
            release_lag=np.array([table.release_lag for table in tables]),
            gain=np.array([table.gain for table in tables]),
            lasts=np.array([table.lasts for table in tables]),
        )

    def _rows(self, table: NDArray, nodes: tuple[NDArray, ...]) -> NDArray:
        return table[np.arange(len(table)), *nodes]


def pulse_table(p: Mapping[str, float], *, supply_voltage: float = 24.0) -> PulseTable:
    """The table of a plant, by some ten thousand short simulations in one batch (a third of a second).

    p: parameters by symbol. supply_voltage: of the coil when on [V].
    """
    vent_rate, release_lag = _venting(p, supply_voltage)
    p1, ratio = (axis.ravel() for axis in np.meshgrid(SUPPLY, RATIO, indexing="ij"))
    under_way = _vented(p, p1, ratio * p1, supply_voltage)
    left_off = _record(p, under_way, STAY)
    p2, shutting = _shut_again(p, left_off, supply_voltage)

    def shaped(values: NDArray) -> NDArray:
        return np.moveaxis(values.reshape(len(AGE), len(SUPPLY), len(RATIO), len(STAY)), 0, 2)

    return PulseTable(
        parameters=p, vent_rate=vent_rate, release_lag=release_lag,
        gain=shaped((p2 - left_off.p2[:, :1]) / BAR), lasts=shaped(STAY + shutting),
    )  # fmt: skip


@lru_cache(maxsize=1024)
def _table_met_before(plant: tuple[tuple[str, float], ...]) -> PulseTable:
    """The table of a plant, made once: searches and lessons meet the same plants again and again."""
    return pulse_table(dict(plant))


def _place(axis: NDArray, value: NDArray) -> tuple[NDArray, NDArray]:
    """The node below each value (n,) and how far beyond it the value is, as a share of the interval."""
    value = np.clip(value, axis[0], axis[-1])
    node = np.clip(np.searchsorted(axis, value, side="right") - 1, 0, len(axis) - 2)
    return node, (value - axis[node]) / (axis[node + 1] - axis[node])


def _valves(p: Mapping[str, float], state: State, U: float) -> Valves:
    """Valves in the given state (fields that broadcast to (n,)) under a constant voltage."""
    valves = Valves(np.size(state.p2))
    valves.set_parameters(np.arange(valves.n), p)
    for field, value in zip(valves.state, state, strict=True):
        field[:] = value
    valves.inputs.U[:] = U
    return valves


def _record(p: Mapping[str, float], state: State, nodes: NDArray) -> State:
    """States at the times `nodes`, the first being 0, with the coil off; fields (n, nodes)."""
    valves = _valves(p, state, 0.0)
    periods = np.diff(nodes)[:, None]
    later = valves.record(valves.inputs._replace(U=np.zeros_like(periods)), periods)
    return State(
        *(
            np.concatenate([np.broadcast_to(first, (1, valves.n)), rest]).T
            for first, rest in zip(state, later, strict=True)
        )
    )


def _venting(p: Mapping[str, float], U: float) -> tuple[float, float]:
    """Rate of ln p3 with the coil off, and the armature's lag before it falls."""
    p1 = SUPPLY[1:2]
    times = np.array([0.0, 20e-3, 40e-3])
    start = energised(p, p1=p1, p2=RATIO[3] * p1, U=U)
    logs = np.log(_record(p, start, times).p3[0])
    rate = (logs[1] - logs[2]) / (times[2] - times[1])
    return float(rate), float(times[1] - (logs[0] - logs[1]) / rate)


def _vented(p: Mapping[str, float], p1: NDArray, p2: NDArray, U: float) -> State:
    """States at the nodes of AGE of a pulse under way that has not raised p2 yet; fields (AGE n,)."""
    start = energised(p, p1=p1, p2=p2, U=U)
    released = start._replace(p3=ABOVE * opening_pressure(p, p1, p2), xMV=0.0, I=0.0, I_coil=0.0)
    under_way = _record({**p, "V2": HELD_VOLUME * p["V2"]}, released, AGE)
    return State(*(field.T.ravel() for field in under_way))


def _shut_again(p: Mapping[str, float], state: State, U: float) -> tuple[NDArray, NDArray]:
    """After switching on in the given states: p2 once the valve has shut [Pa], and when that is [s].

    The time is known to within half of WATCH. Raises ValueError for a plant that stays open.
    """
    valves = _valves(p, State(*(field.ravel() for field in state)), U)
    shutting = np.zeros(valves.n)
    for _ in range(PATIENCE):
        valves.advance(WATCH)
        still_open = valves.state.xPV > 0
        shutting += np.where(still_open, WATCH, 0.0)
        if not np.any(still_open):
            return valves.state.p2.reshape(state.p2.shape), shutting.reshape(state.p2.shape) + WATCH / 2
    raise ValueError(
        f"a pulse cannot be planned: {PATIENCE * WATCH:g} s after switching on with {U:g} V some valve "
        "is still open; check the plant's parameters"
    )
