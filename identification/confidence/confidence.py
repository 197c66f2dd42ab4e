"""How sure a calibration is (section 6.3): intervals, joint region, eq. 23, and a check of the minimum.

Eq. 23 of the report: eps_p = eps_opt (1 + v/(k - v) F), with k measured values and v parameters. The
printed F(k, v - k, p) has negative degrees of freedom; F(v, k - v) quantiles are meant. A parameter's
interval is where the total error, the other parameters held, stays below eps_p (Figures 16 and 17, Table
14).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, f
from statsmodels.tools.numdiff import approx_fprime, approx_hess

from epv_env.plant.parameters import table
from epv_env.plant.region import Region
from identification.block_bootstrap import LEVEL
from identification.calibration.calibrate import Calibration
from identification.calibration.problem import CalibrationProblem
from identification.confidence.covariance import (
    EstimateCovariance,
    estimate_covariance,
)
from identification.report.page import Section, Table, Verdict


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


PRECISE = 0.05
"""Half width of an interval, relative to the estimate, below which the estimate is precise."""

FLAT = 1e-3
"""Largest possible decrease of the total error, relative to the error, at which the gradient counts as
zero."""


def confidence_section(confidence: Confidence) -> Section:
    """Intervals, the joint region, and the check of the minimum."""
    return Section(
        title="Confidence",
        verdicts=[_precision(confidence), _agreement(confidence), _minimum_verdict(confidence)],
        blocks=[_intervals(confidence), _correlations(confidence)],
    )


def confidence_json(confidence: Confidence) -> dict[str, Any]:
    """Intervals and covariance in SI units."""
    scale = confidence.problem.vector.scale
    return {
        "symbols": list(confidence.problem.vector.symbols),
        "intervals95": {s: list(ends) for s, ends in confidence.intervals().items()},
        "eq23": {s: list(ends) for s, ends in confidence.report_intervals().items()},
        "covariance": (confidence.covariance.total * np.outer(scale, scale)).tolist(),
        "chi_square": confidence.chi_square,
        "lags": confidence.covariance.lags,
        "methods_disagree_by": confidence.disagreement,
        "gradient": confidence.minimum.gradient.tolist(),
        "hessian_eigenvalues": confidence.minimum.eigenvalues.tolist(),
    }


def _precision(confidence: Confidence) -> Verdict:
    relative = confidence.half_widths / confidence.estimate
    worst = int(np.argmax(relative))
    return Verdict(
        status="good" if relative[worst] < PRECISE else "doubt",
        text=f"The widest 95 % interval is that of {confidence.problem.vector.symbols[worst]}: "
        f"±{100 * relative[worst]:.2g} %. Intervals hold the noise of outputs and inputs, not the "
        "errors of the other parameters.",
    )


def _agreement(confidence: Confidence) -> Verdict:
    inside = confidence.disagreement <= confidence.chi_square
    return Verdict(
        status="good" if inside else "doubt",
        text=f"The Nelder-Mead estimate lies {'inside' if inside else 'outside'} the joint 95 % region "
        f"of the least-squares estimate (squared distance {confidence.disagreement:.3g}, limit "
        f"{confidence.chi_square:.3g})"
        + ("." if inside else ": the model lacks something that the two weigh differently."),
    )


def _minimum_verdict(confidence: Confidence) -> Verdict:
    minimum = confidence.minimum
    positive = bool(np.all(minimum.eigenvalues > 0))
    steepest, weakest = minimum.gradient @ minimum.gradient, np.min(np.abs(minimum.eigenvalues))
    flat = bool(0.5 * steepest / (weakest * confidence.report.error) < FLAT)
    return Verdict(
        status="good" if positive and flat else "doubt",
        text=f"At the Nelder-Mead estimate the gradient is {'zero' if flat else 'not zero'} and the "
        f"Hessian {'positive definite' if positive else 'not positive definite'}: "
        + ("a local minimum." if positive and flat else "not a proper minimum."),
    )


def _intervals(confidence: Confidence) -> Table:
    """Estimates with their intervals, and where the standard deviations come from."""
    covariance, vector = confidence.covariance, confidence.problem.vector
    parts = (covariance.independent, covariance.residual, covariance.inputs, covariance.total)
    deviations = np.array([np.sqrt(np.diag(part)) for part in parts]) / confidence.estimate
    estimates, intervals = confidence.estimate * vector.scale, confidence.intervals()
    rows = [
        [
            symbol if table()[symbol].unit == "1" else f"{symbol} [{table()[symbol].unit}]",
            *(f"{value:.7g}" for value in (estimate, *intervals[symbol])),
            *(f"{100 * deviation:.4f}" for deviation in own),
        ]
        for symbol, estimate, own in zip(vector.symbols, estimates, deviations.T, strict=True)
    ]
    return Table(
        columns=["Parameter", "estimate", "low", "high", "independent", "sandwich", "inputs", "total"],
        rows=rows,
        caption="95 % intervals of the least-squares estimate, each parameter on its own. Standard "
        "deviations [% of the estimate]: as if residuals were independent; from the residuals as they "
        f"are, over {covariance.lags} samples; from the noise of U and p1 and of the offsets; sandwich "
        "and inputs together.",
    )


def _correlations(confidence: Confidence) -> Table:
    symbols = confidence.problem.vector.symbols
    deviation = np.sqrt(np.diag(confidence.covariance.total))
    matrix = confidence.covariance.total / np.outer(deviation, deviation)
    rows = [
        [symbol, *(f"{value:.3f}" for value in row)] for symbol, row in zip(symbols, matrix, strict=True)
    ]
    return Table(columns=["", *symbols], rows=rows, caption="Correlation of the estimates.")
