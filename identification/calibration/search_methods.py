"""One fit from one start: the report's Nelder-Mead search, or weighted least squares."""

from collections.abc import Mapping
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares, minimize

from identification.calibration.settings import CALIBRATION, CalibrationSettings
from identification.replay.weighted_residuals import WeightedResiduals


@dataclass(frozen=True, kw_only=True)
class SearchResult:
    """Where a search ended, and how."""

    method: str
    """'Nelder-Mead' or 'least squares'."""
    start: NDArray
    """Scaled vector at the start, (k,)."""
    z: NDArray
    """Scaled vector at the end, (k,)."""
    error: float
    """Nelder-Mead: total error (eq. 21, a fraction). Least squares: rms in noise deviations."""
    evaluations: int
    """Of the total error, or steps of the least squares."""
    seconds: float
    """Duration of the search [s]."""
    converged: bool
    message: str
    """Of the optimiser."""

    def as_json(self) -> dict[str, Any]:
        """JSON-ready; `from_json` gives it back."""
        return {**self.__dict__, "start": self.start.tolist(), "z": self.z.tolist()}

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> "SearchResult":
        """A fit as `as_json` wrote it."""
        arrays = {name: np.array(content[name]) for name in ("start", "z")}
        return cls(**{**content, **arrays})


def nelder_mead(
    misfit: WeightedResiduals, start: NDArray, settings: CalibrationSettings = CALIBRATION
) -> SearchResult:
    """Minimise the total error by the simplex search that the report used (section 6.2).

    misfit: with the weights of the total error. start: scaled vector (k,), without unit.
    """
    options = {
        "xatol": settings.precision,
        "fatol": 1e-3 * settings.precision,
        "maxfev": settings.most_evaluations,
    }
    began = perf_counter()
    result = minimize(
        misfit.error, start, method="Nelder-Mead", bounds=misfit.vector.bounds, options=options
    )
    return _fit("Nelder-Mead", start, result, float(result.fun), began)


def weighted_least_squares(
    misfit: WeightedResiduals, start: NDArray, settings: CalibrationSettings = CALIBRATION
) -> SearchResult:
    """Minimise the sum of squares in units of the noise by a trust-region Gauss-Newton method.

    What is known of the parameters before counts like readings do.

    misfit: with the weights of the noise. start: scaled vector (k,), without unit.
    """
    began = perf_counter()
    result = least_squares(
        lambda z: np.concatenate([*misfit.residuals(z), misfit.vector.prior(z)[0]]),
        start,
        jac=lambda z: np.vstack([*misfit.linearised(z)[1], misfit.vector.prior(z)[1]]),  # type: ignore[arg-type]
        bounds=misfit.vector.bounds.T,
        xtol=settings.precision,
        ftol=settings.precision,
        max_nfev=settings.most_steps,
    )
    rms = float(np.sqrt(np.mean(np.square(result.fun))))
    return _fit("least squares", start, result, rms, began)


def _fit(
    method: str, start: NDArray, result: OptimizeResult, error: float, began: float
) -> SearchResult:
    return SearchResult(
        method=method,
        start=np.asarray(start, dtype=float),
        z=np.asarray(result.x, dtype=float),
        error=error,
        evaluations=int(result.nfev),
        seconds=perf_counter() - began,
        converged=bool(result.success),
        message=str(result.message),
    )
