"""Which causes are worth a refit: each one's signature against the residual, linearised once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitter import Fitter, Hypothesis, Point
from identification.gap.fit.variable_projection import Linear, normal
from identification.gap.model.grey_box import Cause


@dataclass(frozen=True, kw_only=True)
class Screened:
    """A cause at one trial size, and what it promises beside other causes."""

    cause: Cause
    sizes: tuple[float, ...]
    """Predicted sizes, within their ranges [SI]."""
    chi_square: float
    """Predicted."""


@dataclass(frozen=True, kw_only=True)
class Signature:
    """What a cause at one trial size changes beside a base point."""

    cause: Cause
    point: Point
    """The base point with the cause."""
    changes: list[NDArray]
    """Of the weighted outputs, per fitted run."""


def trial_points(fitter: Fitter, base: Point, causes: Sequence[Cause]) -> list[tuple[Cause, Point]]:
    """The base point with each cause added at each of its trial sizes."""
    found = []
    values = fitter.values(base)
    for cause in causes:
        joint = Hypothesis(causes=(*base.hypothesis.causes, cause))
        for trial in range(max(len(size.trials) for size in cause.sizes)):
            at = {s.symbol: s.trials[min(trial, len(s.trials) - 1)] for s in cause.sizes}
            found.append((cause, fitter.start(joint, {**values, **at})))
    return found


def signatures(fitter: Fitter, base: Point, causes: Sequence[Cause]) -> list[Signature]:
    """What every cause changes at each of its trial sizes, all simulated side by side."""
    trials = trial_points(fitter, base, causes)
    outputs = fitter.residuals([base, *(point for _, point in trials)], fitter.fitted)
    return [
        Signature(cause=cause, point=point, changes=[block[:, 0] - block[:, 1 + k] for block in outputs])
        for k, (cause, point) in enumerate(trials)
    ]


def screen(fitter: Fitter, base: Point, found: Sequence[Signature]) -> list[Screened]:
    """Every cause's best trial beside the base's own causes, the most promising first.

    The change that a cause makes at a trial size is taken to grow in proportion to its size, and to turn
    round with its sign; with the calibrated parameters and all nuisances it is fitted to the base's
    residual.
    """
    own = fitter.linearise([base], fitter.fitted)[0]
    best: dict[str, Screened] = {}
    for signature in found:
        promise = _promise(own, signature.cause, signature.point, signature.changes)
        label = signature.cause.label
        if label not in best or promise.chi_square < best[label].chi_square:
            best[label] = promise
    return sorted(best.values(), key=lambda screened: screened.chi_square)


def _promise(
    own: Sequence[Linear], cause: Cause, point: Point, signature: Sequence[NDArray]
) -> Screened:
    with_cause = [
        replace(run, slopes=np.column_stack([run.slopes, change]))
        for run, change in zip(own, signature, strict=True)
    ]
    found = normal(with_cause)
    sizes = cause.sizes
    trial = point.vector[len(point.vector) - len(sizes) :] * [size.scale for size in sizes]
    off = np.array([size.off for size in sizes])
    ends = np.array([(size.low - o, size.high - o) for size, o in zip(sizes, off, strict=True)])
    shares = ends / (trial - off)[:, None]
    low, high = np.max(np.min(shares, axis=1)), np.min(np.max(shares, axis=1))
    a, chi_square = _bounded(found.hessian, found.gradient, found.least, low, high)
    return Screened(cause=cause, sizes=tuple((off + a * (trial - off)).tolist()), chi_square=chi_square)


def _bounded(
    hessian: NDArray, gradient: NDArray, chi_square: float, low: float, high: float
) -> tuple[float, float]:
    """The last number of the least-squares step, held in a range, and the chi-square it leaves."""
    k = len(gradient) - 1
    others = hessian[:k, :k] + 1e-9 * np.eye(k)
    inverse = np.linalg.solve(others, np.column_stack([gradient[:k], hessian[:k, k]]))
    curvature = hessian[k, k] - hessian[k, :k] @ inverse[:, 1]
    pull = gradient[k] - hessian[k, :k] @ inverse[:, 0]
    a = float(np.clip(pull / max(curvature, 1e-12), low, high))
    left = chi_square - gradient[:k] @ inverse[:, 0] - 2 * a * pull + a * a * curvature
    return a, float(left)
