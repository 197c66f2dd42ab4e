"""The confidence stage: intervals and joint region of a calibration, and checks of its minimum."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from statsmodels.tools.numdiff import approx_fprime, approx_hess

from epv_env.plant.region import Region
from identification.calibration.calibrate import Calibration
from identification.calibration.problem import CalibrationProblem
from identification.confidence.block_bootstrap import block_bootstrap
from identification.confidence.covariance import EstimateCovariance, estimate_covariance
from identification.confidence.report_interval import ReportInterval, report_interval
from identification.confidence.settings import CONFIDENCE, ConfidenceSettings


@dataclass(frozen=True, kw_only=True)
class Minimum:
    """The total error (eq. 21) around the Nelder-Mead estimate."""

    gradient: NDArray
    """By the scaled parameters (k,); a fraction per fraction."""
    eigenvalues: NDArray
    """Of the Hessian (k,); all positive at a minimum."""
    offsets: NDArray
    """Relative changes of one parameter at a time (points,)."""
    profiles: NDArray
    """Total error with one parameter changed and the others held (k, points)."""


@dataclass(frozen=True, kw_only=True)
class Confidence:
    """How sure a calibration is."""

    problem: CalibrationProblem
    estimate: NDArray
    """Least-squares estimate, scaled (k,)."""
    covariance: EstimateCovariance
    bootstrap: NDArray
    """Movements of the estimate under the block bootstrap (draws, k)."""
    nelder_mead: NDArray
    """The report's estimate, scaled (k,)."""
    report: ReportInterval
    minimum: Minimum
    settings: ConfidenceSettings = CONFIDENCE
    """What the intervals were computed with."""

    @property
    def chi_square(self) -> float:
        """Squared Mahalanobis radius of the joint region."""
        return float(chi2.ppf(self.settings.probability, len(self.estimate)))

    @property
    def half_widths(self) -> NDArray:
        """Of the intervals of each parameter on its own, scaled (k,), without unit."""
        return np.sqrt(chi2.ppf(self.settings.probability, 1) * np.diag(self.covariance.total))

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


def assess_confidence(
    calibration: Calibration, *, seed: int = 0, settings: ConfidenceSettings = CONFIDENCE
) -> Confidence:
    """Intervals of both estimates, the joint region, and the check of gradient and Hessian.

    seed: of the noise drawn for the inputs and of the bootstrap.
    """
    problem = calibration.problem
    misfit = problem.least_squares()
    z = calibration.best("least squares").z
    covariance = estimate_covariance(problem, misfit, z, seed=seed, settings=settings)
    residuals, jacobians = misfit.linearised(z)
    simplex = calibration.best("Nelder-Mead")
    return Confidence(
        problem=problem,
        estimate=z,
        covariance=covariance,
        bootstrap=block_bootstrap(
            residuals,
            jacobians,
            block=settings.blocks_per_lag * covariance.lags,
            prior=problem.vector.prior(z)[1],
            seed=seed,
            draws=settings.bootstrap_draws,
        ),
        nelder_mead=simplex.z,
        report=report_interval(problem, simplex.z, simplex.error, settings.probability),
        minimum=_minimum(problem, simplex.z, settings),
        settings=settings,
    )


def _minimum(problem: CalibrationProblem, z: NDArray, settings: ConfidenceSettings) -> Minimum:
    error = problem.total_error().error
    width = settings.profile_half_width
    offsets = np.linspace(-width, width, settings.profile_points)
    hessian = approx_hess(z, error, epsilon=np.full(len(z), settings.hessian_step))
    return Minimum(
        gradient=np.atleast_1d(approx_fprime(z, error, epsilon=settings.gradient_step, centered=True)),
        eigenvalues=np.linalg.eigvalsh(0.5 * (hessian + hessian.T)),
        offsets=offsets,
        profiles=np.array([[error(z * (1 + d * axis)) for d in offsets] for axis in np.eye(len(z))]),
    )
