"""The confidence stage in the report: Table 14."""

from typing import Any

import numpy as np

from epv_env.plant.parameters import table
from identification.confidence.confidence import Confidence
from identification.report.page import Section, Table, Verdict

PRECISE = 0.05
"""Half width of an interval, relative to the estimate, below which the estimate is precise."""

FLAT = 1e-3
"""Largest possible decrease of the total error, relative to the error, at which the gradient counts as
zero."""


def confidence_section(confidence: Confidence) -> Section:
    """Intervals, the joint region, and the check of the minimum."""
    return Section(
        title="Confidence",
        verdicts=[_precision(confidence), _agreement(confidence), _minimum(confidence)],
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


def _minimum(confidence: Confidence) -> Verdict:
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
