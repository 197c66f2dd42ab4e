"""Where the names of parameters meet the optimiser's vector."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import Parameters, table


@dataclass(frozen=True)
class Vector:
    """Fitted symbols in order; an optimiser sees each divided by its reference value."""

    symbols: tuple[str, ...]
    reference: Parameters
    """Scales of the symbols, and the values of all parameters that are not fitted."""

    @property
    def scale(self) -> NDArray:
        """Reference values [SI], (k,)."""
        return np.array([self.reference[symbol] for symbol in self.symbols])

    @property
    def bounds(self) -> NDArray:
        """Scaled ends of the domains (Tables 6, 7), (k, 2)."""
        domains = [table()[s].domain or (self.reference[s],) * 2 for s in self.symbols]
        return np.sort(np.array(domains) / self.scale[:, None], axis=1)

    def values(self, z: NDArray) -> dict[str, NDArray]:
        """Values by symbol [SI], each of shape (n,), for scaled vectors z (n, k)."""
        return dict(zip(self.symbols, np.moveaxis(np.atleast_2d(z) * self.scale, 1, 0), strict=True))

    def parameters(self, z: NDArray) -> Parameters:
        """The complete set for one scaled vector (k,), within the domains."""
        low, high = self.bounds.T
        return self.reference.replace(
            **{s: float(v[0]) for s, v in self.values(np.clip(z, low, high)).items()}
        )

    def of(self, parameters: Mapping[str, float]) -> NDArray:
        """The scaled vector of a set of parameters, (k,)."""
        return np.array([parameters[symbol] for symbol in self.symbols]) / self.scale
