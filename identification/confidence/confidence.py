"""How sure a calibration is (section 6.3): intervals, joint region, eq. 23, and a check of the minimum.

Eq. 23 of the report: eps_p = eps_opt (1 + v/(k - v) F), with k measured values and v parameters. The
printed F(k, v - k, p) has negative degrees of freedom; F(v, k - v) quantiles are meant. A parameter's
interval is where the total error, the other parameters held, stays below eps_p (Figures 16 and 17, Table
14).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, f
from statsmodels.tools.numdiff import approx_fprime, approx_hess

from epv_env.plant.region import Region
from identification.block_bootstrap import LEVEL
from identification.calibration.calibrate import Calibration
from identification.calibration.problem import CalibrationProblem
from identification.confidence.covariance import (
    EstimateCovariance,
    estimate_covariance,
)


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


def limit_ratio(values: int, parameters: int) -> float:
    """eps_p / eps_opt for a number of measured values and of parameters."""
    degrees = values - parameters
    return 1.0 + parameters / degrees * float(f.ppf(LEVEL, parameters, degrees))


def report_interval(problem: CalibrationProblem, z: NDArray, error: float) -> ReportInterval:
    """Eq. 23 at the minimum of the total error.

    z: the minimum, scaled (k,). error: the total error there, a fraction.
    """
    residuals, jacobians = problem.total_error().linearised(z)
    ratio = limit_ratio(sum(len(r) for r in residuals), len(z))
    curvature = np.sum([J.T @ J for J in jacobians], axis=0)
    return ReportInterval(error=error, ratio=ratio, curvature=curvature)


@dataclass(frozen=True, kw_only=True)
class Minimum:
    """The total error (eq. 21) around the Nelder-Mead estimate."""

    gradient: NDArray
    """By the scaled parameters (k,); a fraction per fraction."""
    eigenvalues: NDArray
    """Of the Hessian (k,); all positive at a minimum."""


@dataclass(frozen=True, kw_only=True)
class Confidence:
    """How sure a calibration is."""

    problem: CalibrationProblem
    estimate: NDArray
    """Least-squares estimate, scaled (k,)."""
    covariance: EstimateCovariance
    nelder_mead: NDArray
    """The report's estimate, scaled (k,)."""
    report: ReportInterval
    minimum: Minimum

    @property
    def chi_square(self) -> float:
        """Squared Mahalanobis radius of the joint region."""
        return float(chi2.ppf(LEVEL, len(self.estimate)))

    @property
    def half_widths(self) -> NDArray:
        """Of the intervals of each parameter on its own, scaled (k,), without unit."""
        return np.sqrt(chi2.ppf(LEVEL, 1) * np.diag(self.covariance.total))

    @cached_property
    def disagreement(self) -> float:
        """Squared Mahalanobis distance of the two methods' estimates in the region's covariance."""
        apart = self.nelder_mead - self.estimate
        return float(apart @ np.linalg.solve(self.covariance.total, apart))

    @property
    def region(self) -> Region:
        """The joint region in SI units, for the plant file."""
        scale = self.problem.vector.scale
        return Region(
            centre=self.problem.vector.parameters(self.estimate),
            symbols=self.problem.vector.symbols,
            covariance=self.covariance.total * np.outer(scale, scale),
            chi_square=self.chi_square,
        )

    def intervals(self) -> Mapping[str, tuple[float, float]]:
        """95 % interval of each parameter on its own [SI]."""
        return self._around(self.estimate, self.half_widths)

    def report_intervals(self) -> Mapping[str, tuple[float, float]]:
        """Eq. 23's interval of each parameter [SI]."""
        return self._around(self.nelder_mead, self.report.half_widths)

    def _around(self, centre: NDArray, half: NDArray) -> dict[str, tuple[float, float]]:
        vector = self.problem.vector
        low, high = (centre - half) * vector.scale, (centre + half) * vector.scale
        return {symbol: (float(low[i]), float(high[i])) for i, symbol in enumerate(vector.symbols)}


def assess_confidence(calibration: Calibration, *, seed: int = 0) -> Confidence:
    """Intervals of both estimates, the joint region, and the check of gradient and Hessian.

    seed: of the noise drawn for the inputs.
    """
    problem = calibration.problem
    misfit = problem.least_squares()
    z = calibration.best("least squares").z
    covariance = estimate_covariance(problem, misfit, z, seed=seed)
    simplex = calibration.best("Nelder-Mead")
    return Confidence(
        problem=problem,
        estimate=z,
        covariance=covariance,
        nelder_mead=simplex.z,
        report=report_interval(problem, simplex.z, simplex.error),
        minimum=_minimum(problem, simplex.z),
    )


def _minimum(problem: CalibrationProblem, z: NDArray) -> Minimum:
    error = problem.total_error().error
    hessian = approx_hess(z, error, epsilon=np.full(len(z), 1e-3))
    return Minimum(
        gradient=np.atleast_1d(approx_fprime(z, error, epsilon=1e-5, centered=True)),
        eigenvalues=np.linalg.eigvalsh(0.5 * (hessian + hessian.T)),
    )
