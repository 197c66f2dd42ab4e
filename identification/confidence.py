"""How sure a calibration is (section 6.3): intervals and joint region, by the diagnosis's covariance."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from epv_env.plant.parameters import table
from epv_env.plant.region import Region, correlation
from identification.block_bootstrap import LEVEL
from identification.calibration.calibrate import Calibration
from identification.calibration.problem import CalibrationProblem
from identification.gap.fit.evidence import variance_inflation
from identification.gap.prepare.noise import residual_noise
from identification.report.page import Section, Table, Verdict


@dataclass(frozen=True, kw_only=True)
class Confidence:
    """How sure a calibration is."""

    problem: CalibrationProblem
    estimate: NDArray
    """Least-squares estimate, scaled (k,)."""
    covariance: NDArray
    """Of that vector (k, k), without unit."""
    widening: float
    """What residuals that are larger than the noise or correlated have widened it by [1]."""
    nelder_mead: NDArray
    """The report's estimate, scaled (k,)."""

    @property
    def chi_square(self) -> float:
        """Squared Mahalanobis radius of the joint region."""
        return float(chi2.ppf(LEVEL, len(self.estimate)))

    @property
    def half_widths(self) -> NDArray:
        """Of the intervals of each parameter on its own, scaled (k,), without unit."""
        return np.sqrt(chi2.ppf(LEVEL, 1) * np.diag(self.covariance))

    @cached_property
    def disagreement(self) -> float:
        """Squared Mahalanobis distance of the two methods' estimates in the region's covariance."""
        apart = self.nelder_mead - self.estimate
        return float(apart @ np.linalg.solve(self.covariance, apart))

    @property
    def region(self) -> Region:
        """The joint region in SI units, for the plant file."""
        scale = self.problem.vector.scale
        return Region(
            centre=self.problem.vector.parameters(self.estimate),
            symbols=self.problem.vector.symbols,
            covariance=self.covariance * np.outer(scale, scale),
            chi_square=self.chi_square,
        )

    def intervals(self) -> Mapping[str, tuple[float, float]]:
        """95 % interval of each parameter on its own [SI]."""
        vector = self.problem.vector
        low, high = ((self.estimate + way * self.half_widths) * vector.scale for way in (-1, 1))
        return {symbol: (float(low[i]), float(high[i])) for i, symbol in enumerate(vector.symbols)}


def estimate_covariance(problem: CalibrationProblem, z: NDArray) -> tuple[NDArray, float]:
    """Covariance of a least-squares estimate, scaled (k, k), and the factor that has widened it [1].

    z: the estimate, scaled (k,).
    """
    evaluated, scale = problem.evaluated(z), problem.vector.scale
    widening = variance_inflation(evaluated, residual_noise(problem.plant, evaluated.residuals))
    return widening * evaluated.covariance / np.outer(scale, scale), widening


def assess_confidence(calibration: Calibration) -> Confidence:
    """Intervals and joint region of the least-squares estimate, and where the other one lies."""
    problem, z = calibration.problem, calibration.best("least squares").z
    covariance, widening = estimate_covariance(problem, z)
    return Confidence(
        problem=problem,
        estimate=z,
        covariance=covariance,
        widening=widening,
        nelder_mead=calibration.best("Nelder-Mead").z,
    )


PRECISE = 0.05
"""Half width of an interval, relative to the estimate, below which the estimate is precise."""


def confidence_section(confidence: Confidence) -> Section:
    """Intervals and the joint region."""
    return Section(
        title="Confidence",
        verdicts=[_precision(confidence), _agreement(confidence)],
        blocks=[_intervals(confidence), _correlations(confidence)],
    )


def confidence_json(confidence: Confidence) -> dict[str, Any]:
    """Intervals and covariance in SI units."""
    scale = confidence.problem.vector.scale
    return {
        "symbols": list(confidence.problem.vector.symbols),
        "intervals95": {s: list(ends) for s, ends in confidence.intervals().items()},
        "covariance": (confidence.covariance * np.outer(scale, scale)).tolist(),
        "chi_square": confidence.chi_square,
        "widening": confidence.widening,
        "methods_disagree_by": confidence.disagreement,
    }


def _precision(confidence: Confidence) -> Verdict:
    relative = confidence.half_widths / confidence.estimate
    worst = int(np.argmax(relative))
    return Verdict(
        status="good" if relative[worst] < PRECISE else "doubt",
        text=f"The widest 95 % interval is that of {confidence.problem.vector.symbols[worst]}: "
        f"±{100 * relative[worst]:.2g} %. Intervals hold the noise of the outputs, not that of the "
        "inputs or the errors of the other parameters.",
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


def _intervals(confidence: Confidence) -> Table:
    """Estimates with their intervals and standard deviations."""
    vector, intervals = confidence.problem.vector, confidence.intervals()
    deviations = np.sqrt(np.diag(confidence.covariance)) / confidence.estimate
    estimates = confidence.estimate * vector.scale
    rows = [
        [
            symbol if table()[symbol].unit == "1" else f"{symbol} [{table()[symbol].unit}]",
            *(f"{value:.7g}" for value in (estimate, *intervals[symbol])),
            f"{100 * deviation:.4f}",
        ]
        for symbol, estimate, deviation in zip(vector.symbols, estimates, deviations, strict=True)
    ]
    return Table(
        columns=["Parameter", "estimate", "low", "high", "standard deviation [%]"],
        rows=rows,
        caption="95 % intervals of the least-squares estimate, each parameter on its own. Residuals "
        "that are larger than the noise, or correlated, have raised the variances by a factor of "
        f"{confidence.widening:.3g}.",
    )


def _correlations(confidence: Confidence) -> Table:
    symbols = confidence.problem.vector.symbols
    matrix = correlation(confidence.covariance)
    rows = [
        [symbol, *(f"{value:.3f}" for value in row)] for symbol, row in zip(symbols, matrix, strict=True)
    ]
    return Table(columns=["", *symbols], rows=rows, caption="Correlation of the estimates.")
