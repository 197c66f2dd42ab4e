"""The confidence stage in the report: Table 14, Figures 16 and 17, and the joint region."""

from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from epv_env.plant.parameters import table
from identification.confidence.confidence import Confidence
from identification.report.page import Picture, Section, Table, Verdict

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
        blocks=[
            _intervals(confidence),
            _deviations(confidence),
            _correlations(confidence),
            Picture(
                figure=profiles(confidence),
                caption="Model error over one parameter at a time.",
            ),
            Picture(
                figure=region(confidence),
                caption="Joint 95 % region along pairs of parameters, relative to the estimate.",
            ),
        ],
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
        text="95 % intervals, each parameter on its own: "
        + ", ".join(
            f"{symbol} ±{100 * width:.2g} %"
            for symbol, width in zip(confidence.problem.vector.symbols, relative, strict=True)
        )
        + ". They hold the noise of outputs and inputs, not the errors of the other parameters.",
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
    positive = bool(np.all(confidence.minimum.eigenvalues > 0))
    flat = _decrease(confidence) < FLAT
    return Verdict(
        status="good" if positive and flat else "doubt",
        text=f"At the Nelder-Mead estimate the gradient is {'zero' if flat else 'not zero'} and the "
        f"Hessian {'positive definite' if positive else 'not positive definite'}: "
        + ("a local minimum." if positive and flat else "not a proper minimum."),
    )


def _decrease(confidence: Confidence) -> float:
    """Greatest decrease of the total error that its gradient promises, relative to it."""
    minimum = confidence.minimum
    steepest = float(minimum.gradient @ minimum.gradient)
    return 0.5 * steepest / (float(np.min(np.abs(minimum.eigenvalues))) * confidence.report.error)


def _intervals(confidence: Confidence) -> Table:
    symbols = confidence.problem.vector.symbols
    estimates = confidence.estimate * confidence.problem.vector.scale
    rows = [
        [
            f"{symbol} [{table()[symbol].unit}]",
            f"{estimate:.7g}",
            *(f"{end:.7g}" for end in confidence.intervals()[symbol]),
        ]
        for symbol, estimate in zip(symbols, estimates, strict=True)
    ]
    return Table(
        columns=["Parameter", "estimate", "low", "high"],
        rows=rows,
        caption="95 % intervals of the least-squares estimate (sandwich covariance, inputs' noise).",
    )


def _deviations(confidence: Confidence) -> Table:
    covariance = confidence.covariance
    parts = [
        np.sqrt(np.diag(covariance.independent)),
        np.sqrt(np.diag(covariance.residual)),
        np.sqrt(np.diag(covariance.inputs)),
        np.sqrt(np.diag(covariance.total)),
    ]
    rows = [
        [symbol, *(f"{100 * part[i] / confidence.estimate[i]:.4f}" for part in parts)]
        for i, symbol in enumerate(confidence.problem.vector.symbols)
    ]
    columns = ["Parameter", "independent", "sandwich", "inputs", "total"]
    caption = (
        f"Standard deviations [% of the estimate]: as if residuals were independent; from the residuals "
        f"as they are, over {covariance.lags} samples; from the noise of U and p1 and of the offsets; "
        "sandwich and inputs together."
    )
    return Table(columns=columns, rows=rows, caption=caption)


def _correlations(confidence: Confidence) -> Table:
    symbols = confidence.problem.vector.symbols
    deviation = np.sqrt(np.diag(confidence.covariance.total))
    matrix = confidence.covariance.total / np.outer(deviation, deviation)
    rows = [
        [symbol, *(f"{value:.3f}" for value in row)] for symbol, row in zip(symbols, matrix, strict=True)
    ]
    return Table(columns=["", *symbols], rows=rows, caption="Correlation of the estimates.")


def profiles(confidence: Confidence) -> Figure:
    """Total error over one parameter at a time, the others held (Figures 16 and 17)."""
    vector = confidence.problem.vector
    figure = Figure(figsize=(9, 5.5), layout="constrained")
    panels = _panels(figure, len(vector.symbols))
    centre = confidence.nelder_mead * vector.scale
    rows = zip(panels, vector.symbols, centre, confidence.minimum.profiles, strict=True)
    for axes, symbol, value, profile in rows:
        axes.plot(value * (1 + confidence.minimum.offsets), 100 * profile, color="tab:blue")
        low, high = confidence.intervals()[symbol]
        axes.axvspan(low, high, color="tab:green", alpha=0.3, label="95 % interval")
        axes.axvline(value, color="black", linewidth=0.6)
        axes.set_xlabel(_axis(symbol))
        axes.grid(alpha=0.3)
    panels[0].legend(fontsize="small")
    figure.supylabel("total error [%]")
    return figure


def region(confidence: Confidence) -> Figure:
    """The joint region seen along pairs of parameters, with both estimates."""
    symbols = confidence.problem.vector.symbols
    pairs = list(combinations(range(len(symbols)), 2))
    figure = Figure(figsize=(9, 6), layout="constrained")
    for axes, pair in zip(_panels(figure, len(pairs)), pairs, strict=False):
        _pair(axes, confidence, pair)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize="small")
    return figure


def _pair(axes: Axes, confidence: Confidence, pair: tuple[int, int]) -> None:
    """One panel: everything relative to the estimate, in parts per thousand."""
    i, j = pair
    covariance = confidence.covariance
    centre = confidence.estimate
    relative = 1e3 / centre[list(pair)]
    for matrix, style, label in (
        (covariance.independent, "--", "independent residuals, exact inputs"),
        (covariance.total, "-", "joint 95 % region"),
    ):
        outline = _ellipse(matrix[np.ix_(pair, pair)], confidence.chi_square) * relative
        axes.plot(*outline.T, style, color="tab:green", label=label)
    apart = (confidence.nelder_mead - centre)[[i, j]] * relative
    axes.plot(*apart, "x", color="tab:red", label="Nelder-Mead")
    axes.plot(0.0, 0.0, "+", color="black", label="least squares")
    symbols = confidence.problem.vector.symbols
    axes.set_xlabel(f"{symbols[i]}: change [‰]")
    axes.set_ylabel(f"{symbols[j]}: change [‰]")
    axes.grid(alpha=0.3)


def _ellipse(covariance: NDArray, radius: float) -> NDArray:
    """Outline (points, 2) of the ellipsoid's shadow on two of its axes."""
    angle = np.linspace(0.0, 2 * np.pi, 100)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.sqrt(radius) * circle @ np.linalg.cholesky(covariance).T


def _panels(figure: Figure, count: int) -> list[Axes]:
    columns = 2 if count <= 4 else 3
    panels = np.ravel(figure.subplots(-(-count // columns), columns, squeeze=False))
    for spare in panels[count:]:
        spare.remove()
    return list(panels[:count])


def _axis(symbol: str) -> str:
    unit = table()[symbol].unit
    return symbol if unit == "1" else f"{symbol} [{unit}]"
