"""A region of plants as a box of coordinates from 0 to 1, for designs and searches."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from epv_env.plant.parameters import table
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
        points = np.hstack([boxed, self._joint(2 * coordinates[:, len(boxes) :] - 1)])
        return [
            {symbol: _inside(symbol, value) for symbol, value in zip(self.symbols, row, strict=True)}
            for row in points.tolist()
        ]

    def _joint(self, cube: NDArray) -> NDArray:
        """Points of the ellipsoid (points, k) for those of the cube from -1 to 1."""
        region = self.region
        if region.covariance is None:
            return cube
        length = np.linalg.norm(cube, axis=1, keepdims=True)
        ball = cube * np.max(np.abs(cube), axis=1, keepdims=True) / np.where(length > 0, length, 1.0)
        deviation = np.sqrt(np.diag(region.covariance))
        scale = np.where(deviation > 0, deviation, 1.0)
        variances, axes = np.linalg.eigh(region.covariance / np.outer(scale, scale))
        offset = (ball * np.sqrt(np.maximum(variances, 0))) @ axes.T * deviation
        return np.array([region.centre[s] for s in region.symbols]) + offset * np.sqrt(region.chi_square)

    def latin_hypercube(self, points: int, seed: int) -> NDArray:
        """Coordinates (points, symbols): each symbol's range is cut into slices of one point each."""
        return qmc.LatinHypercube(len(self.symbols), rng=seed).random(points)


def _inside(symbol: str, value: float) -> float:
    """The value within the parameter's domain: rounding or an ellipsoid may step over its end."""
    low, high = table()[symbol].domain or (value, value)
    return min(max(value, low), high)
