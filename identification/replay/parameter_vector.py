"""Where the names of parameters meet the optimiser's vector."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import Parameters


@dataclass(frozen=True)
class ParameterVector:
    """Fitted symbols in order; an optimiser sees each divided by its reference value."""

    symbols: tuple[str, ...]
    reference: Parameters
    """Scales of the symbols, and the values of all parameters that are not fitted."""

    @property
    def scale(self) -> NDArray:
        """Reference values [SI], (k,)."""
        return np.array([self.reference[symbol] for symbol in self.symbols])

    @property
    def domains(self) -> NDArray:
        """Ends of the domains (Tables 6, 7) [SI], (k, 2)."""
        return np.array([self.reference.domain(s) for s in self.symbols])

    @property
    def bounds(self) -> NDArray:
        """Scaled ends of the domains, the lesser first, (k, 2), without unit."""
        return np.sort(self.domains / self.scale[:, None], axis=1)

    def values(self, z: NDArray) -> dict[str, NDArray]:
        """Values by symbol [SI], each of shape (n,), for scaled vectors z (n, k)."""
        return dict(zip(self.symbols, np.moveaxis(np.atleast_2d(z) * self.scale, 1, 0), strict=True))

    def parameters(self, z: NDArray) -> Parameters:
        """The complete set [SI] for one scaled vector (k,), within the domains."""
        inside = np.clip(z * self.scale, *self.domains.T)
        return self.reference.replace(**dict(zip(self.symbols, inside.tolist(), strict=True)))

    def scaled(self, parameters: Mapping[str, float]) -> NDArray:
        """The scaled vector (k,), without unit, of a set of parameters [SI]."""
        return np.array([parameters[symbol] for symbol in self.symbols]) / self.scale
