"""The report's confidence interval (eq. 23), as printed.

eps_p = eps_opt (1 + v/(k - v) F), with k measured values and v parameters. The printed F(k, v - k, p)
has negative degrees of freedom; F(v, k - v) quantiles are meant. A parameter's interval is where the
total error, the other parameters held, stays below eps_p (Figures 16 and 17, Table 14).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f

from identification.calibration.problem import CalibrationProblem
from identification.confidence.settings import CONFIDENCE


@dataclass(frozen=True, kw_only=True)
class ReportInterval:
    """Eq. 23 around the Nelder-Mead estimate, where the squared total error is quadratic."""

    error: float
    """eps_opt, a fraction."""
    ratio: float
    """eps_p / eps_opt."""
    curvature: NDArray
    """J'J of the total error's residuals by the scaled parameters (k, k)."""

    @property
    def squared_rise(self) -> float:
        """eps_p^2 - eps_opt^2."""
        return self.error**2 * (self.ratio**2 - 1.0)

    @property
    def half_widths(self) -> NDArray:
        """Of the interval of each parameter while the others are held, scaled (k,), without unit."""
        return np.sqrt(self.squared_rise / np.diag(self.curvature))

    def holds_jointly(self, apart: NDArray) -> bool:
        """Whether a vector has a total error below eps_p.

        apart: the vector less the estimate, scaled (k,), without unit.
        """
        return bool(apart @ self.curvature @ apart <= self.squared_rise)


def limit_ratio(values: int, parameters: int, probability: float = CONFIDENCE.probability) -> float:
    """eps_p / eps_opt for a number of measured values and of parameters."""
    degrees = values - parameters
    return 1.0 + parameters / degrees * float(f.ppf(probability, parameters, degrees))


def report_interval(
    problem: CalibrationProblem,
    z: NDArray,
    error: float,
    probability: float = CONFIDENCE.probability,
) -> ReportInterval:
    """Eq. 23 at the minimum of the total error.

    z: the minimum, scaled (k,). error: the total error there, a fraction.
    """
    residuals, jacobians = problem.total_error().linearised(z)
    ratio = limit_ratio(sum(len(r) for r in residuals), len(z), probability)
    curvature = np.sum([J.T @ J for J in jacobians], axis=0)
    return ReportInterval(error=error, ratio=ratio, curvature=curvature)
