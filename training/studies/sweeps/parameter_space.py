"""A region of plants as a box of coordinates from 0 to 1, for designs and searches."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from epv_env.plant.region import Region


@dataclass(frozen=True, kw_only=True)
class Space:
    """Coordinates of a region that varies: its boxes, then its ellipsoid's."""

    region: Region

    @property
    def symbols(self) -> tuple[str, ...]:
        """Parameter that each coordinate belongs to."""
        return (*self.region.boxes, *self.region.symbols)

    def values(self, coordinates: NDArray) -> list[dict[str, float]]:
        """Values by symbol [SI] for coordinates (points, symbols) from 0 to 1.

        The coordinates of an ellipsoid are a cube that is drawn in to the ball along its rays.
        """
        boxes = self.region.boxes
        ends = np.array(list(boxes.values())).reshape(-1, 2)
        boxed = ends[:, 0] + coordinates[:, : len(boxes)] * np.ptp(ends, axis=1)
        points = np.hstack([boxed, self.region.joint(_ball(2 * coordinates[:, len(boxes) :] - 1))])
        return [
            {
                symbol: self._inside(symbol, value)
                for symbol, value in zip(self.symbols, row, strict=True)
            }
            for row in points.tolist()
        ]

    def _inside(self, symbol: str, value: float) -> float:
        """The value within the parameter's domain: rounding may step over its end."""
        low, high = self.region.centre.domain(symbol)
        return min(max(value, low), high)

    def latin_hypercube(self, points: int, seed: int) -> NDArray:
        """Coordinates (points, symbols): each symbol's range is cut into slices of one point each."""
        return qmc.LatinHypercube(len(self.symbols), rng=seed).random(points)


def _ball(cube: NDArray) -> NDArray:
    """Points of the unit ball (points, k): those of the cube from -1 to 1, drawn in along their rays."""
    length = np.linalg.norm(cube, axis=1, keepdims=True)
    furthest = np.max(np.abs(cube), axis=1, keepdims=True, initial=0.0)
    return cube * furthest / np.where(length > 0, length, 1.0)
