"""Where the names of parameters meet the optimiser's vector."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.free_parameters import Freedom
from epv_env.plant.parameters import Parameters


@dataclass(frozen=True)
class ParameterVector:
    """Fitted symbols in order; an optimiser sees each divided by its reference value."""

    symbols: tuple[str, ...]
    reference: Parameters
    """Scales of the symbols, and the values of all parameters that are not fitted."""
    freedoms: Mapping[str, Freedom] = field(default_factory=dict)
    """Bounds and prior knowledge by symbol; a symbol without has its domain, and nothing is known."""

    @property
    def scale(self) -> NDArray:
        """Reference values [SI], (k,)."""
        return np.array([self.reference[symbol] for symbol in self.symbols])

    @property
    def domains(self) -> NDArray:
        """Least and greatest values: given bounds, else the ends of the domains [SI], (k, 2)."""
        return np.array([self._freedom(s).bounds or self.reference.domain(s) for s in self.symbols])

    @property
    def bounds(self) -> NDArray:
        """Scaled ends of the domains, the lesser first, (k, 2), without unit."""
        return np.sort(self.domains / self.scale[:, None], axis=1)

    def _freedom(self, symbol: str) -> Freedom:
        return self.freedoms.get(symbol, Freedom())

    def prior(self, z: NDArray) -> tuple[NDArray, NDArray]:
        """What is known before of a scaled vector z (k,): residuals (p,) and derivatives (p, k).

        One for each of the p symbols with a mean: the departure from it in standard deviations.
        """
        known = [(i, self._freedom(s)) for i, s in enumerate(self.symbols)]
        rows = [(i, f.mean, f.sd) for i, f in known if f.mean is not None and f.sd is not None]
        residuals = np.array([(mean - self.scale[i] * z[i]) / sd for i, mean, sd in rows])
        slopes = np.zeros((len(rows), len(z)))
        for row, (i, _, sd) in enumerate(rows):
            slopes[row, i] = -self.scale[i] / sd
        return residuals, slopes

    def known(self) -> dict[str, tuple[float | None, float | None]]:
        """Mean and standard deviation of what is known before, by symbol [SI], ready for JSON."""
        freedoms = {symbol: self._freedom(symbol) for symbol in self.symbols}
        return {s: (f.mean, f.sd) for s, f in freedoms.items() if f.mean is not None}

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
