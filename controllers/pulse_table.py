"""Lookup table of a pulse: how long must the coil be off to add this much pressure?

While the coil is off the control chamber vents through its exhaust: ln p3 falls at one constant rate
while the exhaust is choked, and more slowly below 1.9 times the ambient pressure. The measured p3
therefore says how far a pulse has come, whatever p3 it began at, and one table serves pulses from rest,
pulses in quick succession and a valve that begins wide open: pressure gained, as a function of p1,
p2/p1, the age of the venting (since p3 stood 5 % above the opening pressure) and the time that the coil
stays off.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.opening_pressure import opening_pressure
from controllers.venting_time import venting_time
from epv_env.common.units import BAR, MILLISECOND


def _milliseconds(*values: float) -> NDArray:
    return np.array(values) * MILLISECOND


@dataclass(frozen=True, kw_only=True, eq=False)
class PulseGrid:
    """Nodes of the table's axes, and where the age of the venting counts from."""

    supply: NDArray = field(default_factory=lambda: np.array([7.0, 11.0, 15.0]) * BAR)
    """Nodes of p1 [Pa]; beyond the ends of an axis its end holds."""
    ratio: NDArray = field(
        default_factory=lambda: np.array([0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98])
    )
    """Nodes of p2/p1 [1]; denser where the flow falls steeply with the ratio."""
    age: NDArray = field(
        default_factory=lambda: _milliseconds(*range(0, 26, 2), 30, 40, 50, 70, 100, 150, 200, 300)
    )
    """Nodes of the venting's age [s]; after the last one the chamber is empty."""
    stay: NDArray = field(default_factory=lambda: _milliseconds(*range(0, 30, 2), 35, 40, 50, 70, 100))
    """Nodes of the time that the coil stays off [s]."""
    start_ratio: float = 1.05
    """p3 over the opening pressure at age zero [1]: the valve stays shut for some milliseconds more."""

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Lengths of the axes supply, ratio, age and stay."""
        return len(self.supply), len(self.ratio), len(self.age), len(self.stay)


GRID = PulseGrid()
"""The grid of the pulse controllers."""


@dataclass(frozen=True, kw_only=True)
class PulseTable:
    """What p2 gains by leaving the coil off for a while. Bar and seconds.

    Arguments of the methods are arrays (n,): measured p1, p2, p3 [bar absolute] with the coil off. Each
    valve's answer is the same to the bit whatever n.
    """

    parameters: Mapping[str, Any]
    """Of the plant, by symbol."""
    vent_rate: float | NDArray
    """-d ln(p3)/dt while the coil is off and the exhaust is choked [1/s]."""
    release_lag: float | NDArray
    """From switching off to the control chamber's venting [s]."""
    gain: NDArray
    """p2 added until the valve has shut again [bar]; shape of the grid (supply, ratio, age, stay)."""
    lasts: NDArray
    """From now until the valve has shut again [s]; the same shape."""
    grid: PulseGrid = GRID

    def of(self, who: NDArray) -> "PulseTable":
        """The table of some of the valves, indices (m,), where parameters differ between them."""
        own = {s: v[who] if isinstance(v, np.ndarray) else v for s, v in self.parameters.items()}
        return replace(self, parameters=own)

    def venting_age(self, p1: NDArray, p2: NDArray, p3: NDArray) -> NDArray:
        """Time since p3 stood at the grid's start ratio [s], (n,); negative: it is yet to come."""
        opening = opening_pressure(self.parameters, p1 * BAR, p2 * BAR) / BAR
        ambient = self.parameters["p_env"] / BAR
        start = self.grid.start_ratio * np.maximum(opening, 1.0) / ambient
        return (venting_time(start) - venting_time(p3 / ambient)) / self.vent_rate

    def time_to_open(self, p1: NDArray, p2: NDArray, p3: NDArray) -> NDArray:
        """Time with the coil off until p3 passes the opening pressure [s], (n,); negative: it has."""
        return np.log(self.grid.start_ratio) / self.vent_rate - self.venting_age(p1, p2, p3)

    def gained(
        self, p1: NDArray, p2: NDArray, p3: NDArray, stay: NDArray, slope: NDArray | float = 0.0
    ) -> NDArray:
        """Change of p2 until the valve has shut, if the coil stays off for `stay` (n,) [s] [bar].

        slope: of p2 by consumption [bar/s], a number or (n,). A stay that ends before age zero adds
        nothing and counts as one until then.
        """
        age = self.venting_age(p1, p2, p3)
        curve = self._curve(p1, p2, age, slope)
        node, share = _place(self.grid.stay, stay + np.minimum(age, 0.0))
        row = np.arange(len(curve))
        return curve[row, node] * (1 - share) + curve[row, node + 1] * share

    def gained_at_once(self, p1: NDArray, p2: NDArray, p3: NDArray) -> NDArray:
        """`gained` without stay and slope (n,) [bar]: what is under way if the coil is switched on."""
        gain = np.zeros(len(p1))
        for weight, nodes in self._corners(p1, p2, self.venting_age(p1, p2, p3)):
            gain += weight * self._rows(self.gain[..., 0], nodes)
        return gain

    def duration(
        self, p1: NDArray, p2: NDArray, p3: NDArray, asked: NDArray, slope: NDArray | float = 0.0
    ) -> NDArray:
        """The inverse of `gained`: how long the coil must stay off to change p2 by `asked` (n,) [s].

        Zero where more than that is under way already; at most the table's end, long past opening.
        """
        age = self.venting_age(p1, p2, p3)
        curve = self._curve(p1, p2, age, slope)
        stays = self.grid.stay
        # Before the valve opens the curve only falls, below its first value: beyond that it is monotone.
        node = np.clip(np.sum(curve < asked[:, None], axis=1) - 1, 0, len(stays) - 2)
        row = np.arange(len(curve))
        low, high = curve[row, node], curve[row, node + 1]
        share = np.clip((asked - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)
        stay = stays[node] * (1 - share) + stays[node + 1] * share
        return np.where(asked > curve[:, 0], stay - np.minimum(age, 0.0), 0.0)

    def _curve(self, p1: NDArray, p2: NDArray, age: NDArray, slope: NDArray | float) -> NDArray:
        """Change of p2 over the nodes of stay (n, stay), linear between the nodes of the other axes."""
        gain, lasts = np.zeros((2, len(p1), len(self.grid.stay)))
        for weight, nodes in self._corners(p1, p2, age):
            gain += weight[:, None] * self._rows(self.gain, nodes)
            lasts += weight[:, None] * self._rows(self.lasts, nodes)
        return gain + np.reshape(slope, (-1, 1)) * (lasts - np.minimum(age, 0.0)[:, None])

    def _corners(
        self, p1: NDArray, p2: NDArray, age: NDArray
    ) -> Iterator[tuple[NDArray, tuple[NDArray, ...]]]:
        """Weights (n,) and nodes (n,) of the cells' eight corners on the axes supply, ratio and age."""
        grid = self.grid
        axes = ((grid.supply, p1 * BAR), (grid.ratio, p2 / p1), (grid.age, age))
        places = [_place(axis, value) for axis, value in axes]
        nodes = [(node, node + 1) for node, _ in places]
        shares = [(1 - share, share) for _, share in places]
        for i, j, k in product(range(2), repeat=3):
            yield shares[0][i] * shares[1][j] * shares[2][k], (nodes[0][i], nodes[1][j], nodes[2][k])

    def _rows(self, table: NDArray, nodes: tuple[NDArray, ...]) -> NDArray:
        """The table at nodes (n,) of its axes supply, ratio and age: rows (n, stay), or (n,)."""
        return table[nodes]


class PulseTables(PulseTable):
    """A table for each of n valves: arrays with a first axis (n,), parameters (n,) by symbol."""

    def _rows(self, table: NDArray, nodes: tuple[NDArray, ...]) -> NDArray:
        return table[np.arange(len(table)), *nodes]


def _place(axis: NDArray, value: NDArray) -> tuple[NDArray, NDArray]:
    """The node below each value (n,) and how far beyond it the value is, as a share of the interval."""
    value = np.minimum(np.maximum(value, axis[0]), axis[-1])  # np.clip takes longer
    node = np.minimum(np.searchsorted(axis, value, side="right") - 1, len(axis) - 2)
    return node, (value - axis[node]) / (axis[node + 1] - axis[node])
