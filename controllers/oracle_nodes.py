"""Nodes of the oracle's search: states side by side, and when two of them count as the same."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR
from epv_env.plant.equations import State

LONGEST_LOOK = 64
"""Most moves that a node remembers: one bit each of an integer."""


@dataclass(frozen=True, kw_only=True)
class MergeTolerance:
    """Differences of the state within which two nodes count as the same.

    A venting p3 has to pass a tolerance in each period. Otherwise the later of two vents, cheaper so
    far, would always take the place of the earlier one.
    """

    p2: float = 0.01 * BAR
    """[Pa]"""
    p3: float = 0.1 * BAR
    """[Pa]"""
    I: float = 0.1  # noqa: E741 - the current's symbol
    """[A]"""
    xMV: float = 0.25e-3
    """[m]"""
    xPV: float = 0.25e-3
    """[m]"""


MERGE_TOLERANCE = MergeTolerance()
"""The oracle's."""


@dataclass(frozen=True, kw_only=True)
class Nodes:
    """The kept nodes of one layer, arrays (n, width)."""

    state: State
    """Fields (n, width)."""
    compressor: NDArray
    """Whether the compressor runs (n, width), bool."""
    coil: NDArray
    """The last move (n, width), bool."""
    price: NDArray
    """Price of the moves since the decided ones (n, width) [1]; infinite where there is no node."""
    moves: NDArray
    """These moves as bits, the last one lowest (n, width), uint64."""

    def take(self, where: NDArray) -> "Nodes":
        """The nodes at these places (n, k) of each row; a place may be named twice."""

        def taken(values: NDArray) -> NDArray:
            return np.take_along_axis(values, where, axis=1)

        return Nodes(
            state=State(*map(taken, self.state)), compressor=taken(self.compressor),
            coil=taken(self.coil), price=taken(self.price), moves=taken(self.moves),
        )  # fmt: skip
