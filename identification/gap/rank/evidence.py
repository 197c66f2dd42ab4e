"""How well a refitted hypothesis explains the recordings: evidence that expects imperfect forms.

A cause's true form is never quite ours. So a hypothesis may miss the recordings, in every short stretch
on its own, by a share of what the cause does there: a Gaussian allowance, integrated out in closed form.
How large that share is the recordings say, up to a tenth; what is left beyond it counts in full.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from identification.gap.fit.fitter import Fitter, Point
from identification.gap.fit.variable_projection import Linear, Normal, freed, normal

FORM_ERRORS = (0.0, 0.003, 0.01, 0.02, 0.05, 0.1)
"""Relative standard deviations of a cause's effect, in a stretch, from what our form gives; beforehand
each is as likely as the next."""

STRETCH = 5e-3
"""Time over which a form's error is taken to be constant [s]."""

GENERIC_STRETCHES = (1.5e-3, STRETCH, 20e-3)
"""Times over which a misfit without a name may be constant [s]."""

AT_END = 1e-4
"""Share of its range within which a size counts as lying at its end."""

SINGULAR = 1e-12
"""Eigenvalue of a correlation matrix below which it is rounding."""

GENERIC = np.logspace(-4, 3, 29)
"""Variances, in noise variances, that a misfit without a name may have in a stretch."""


@dataclass(frozen=True, kw_only=True)
class Assessed:
    """A refitted hypothesis and what speaks for it."""

    point: Point
    residuals: list[NDArray]
    """Per run (channels, samples), freed of nuisances; 0 where readings are not trusted."""
    log_evidence: float
    with_leftover: float
    """Log evidence of the hypothesis beside a misfit without a name."""
    tolerances: NDArray
    """What the fitted runs say of them, in standard deviations from their centres, (m,)."""
    covariance: NDArray
    """Of the calibrated parameters and the sizes, all else free, (k, k) [SI]."""
    converged: bool

    @property
    def excess(self) -> float:
        """Sum of squares beyond that of noise."""
        return sum(float(np.sum(r**2) - np.count_nonzero(r)) for r in self.residuals)

    @property
    def at_end(self) -> bool:
        """Whether a size lies at an end of its physical range: the data ask for what cannot be."""
        sizes = self.point.hypothesis.sizes
        for size, scaled in zip(sizes, self.point.vector[self.point.first_size :], strict=True):
            low, high = sorted((size.low, size.high))
            value, margin = scaled * size.scale, AT_END * (high - low)
            if min(value - low, high - value) < margin and abs(value - size.off) > margin:
                return True
        return False

    @property
    def name(self) -> tuple[str, ...]:
        """The causes' labels."""
        return self.point.hypothesis.name


def assess(fitter: Fitter, points: Sequence[Point]) -> list[Assessed]:
    """Evidence of each fitted point on all runs; its vector has seen the calibration runs only.

    Tolerances and starts, which are nuisances with priors, adapt to the held-out runs as well.
    """
    if not points:
        return []
    linear = fitter.linearise(points, fitter.everything)
    return [_assessed(fitter, point, runs) for point, runs in zip(points, linear, strict=True)]


def _assessed(fitter: Fitter, point: Point, runs: Sequence[Linear]) -> Assessed:
    shared = normal(runs).shared
    residuals, steps = zip(*(freed(run, shared) for run in runs), strict=True)
    strain = float(shared @ shared) + sum(
        float(np.sum(((run.local_value + step) / run.local_sd) ** 2))
        for run, step in zip(runs, steps, strict=True)
    )
    misfits = np.sum(
        [
            _misfits(fitter, r, residual, _effects(point, run))
            for r, (residual, run) in enumerate(zip(residuals, runs, strict=True))
        ],
        axis=0,
    )
    fitted = normal([runs[r] for r in fitter.fitted])
    covariance = _covariance(fitted)
    scales = [size.scale for size in fitter.sizes(point)]
    shaped = [
        residual.reshape(run.measured.shape)
        for residual, run in zip(residuals, fitter.plant.runs, strict=True)
    ]
    price = _occam(point, np.sqrt(np.diag(covariance))) + 0.5 * strain
    return Assessed(
        point=point,
        residuals=shaped,
        log_evidence=float(logsumexp(-0.5 * misfits) - np.log(len(misfits))) - price,
        with_leftover=generic_log_evidence(fitter, shaped) - price,
        tolerances=fitted.shared,
        covariance=covariance * np.outer(scales, scales),
        converged=point.converged,
    )


def generic_log_evidence(fitter: Fitter, residuals: Sequence[NDArray]) -> float:
    """Evidence of a misfit without a name: in every stretch of a channel an offset of its own.

    Its variance and the stretch are fitted for each channel (type-II likelihood, at the price of the
    fitted numbers).
    """
    total = 0.0
    for channel in range(len(residuals[0])):
        series = [residual[channel] for residual in residuals]
        squares = sum(float(np.sum(np.square(part))) for part in series)
        gains = [_generic_gain(fitter, series, stretch) for stretch in GENERIC_STRETCHES]
        total += -0.5 * (squares - max(gains)) - np.log(len(GENERIC_STRETCHES))
    return total


def _generic_gain(fitter: Fitter, series: Sequence[NDArray], stretch: float) -> float:
    """By how much offsets of the best variance lower -2 log likelihood, less the price of a number."""
    parts = [
        stretches(part, run.time[1], stretch)
        for part, run in zip(series, fitter.plant.runs, strict=True)
    ]
    s = np.concatenate([np.sum(part, axis=1) for part in parts])
    n = np.concatenate([np.sum(part != 0, axis=1) for part in parts])
    gains = [np.sum(v * s**2 / (1 + v * n) - np.log1p(v * n)) for v in GENERIC]
    return float(max(gains)) - np.log(len(s))


def inflation(fitter: Fitter, residuals: Sequence[NDArray]) -> float:
    """Variance of sums over stretches relative to that of white residuals, at least 1."""
    parts = [
        stretches(channel, run.time[1])
        for residual, run in zip(residuals, fitter.plant.runs, strict=True)
        for channel in residual
    ]
    together = sum(float(np.sum(np.sum(part, axis=1) ** 2)) for part in parts)
    apart = sum(float(np.sum(part**2)) for part in parts)
    return max(1.0, together / apart)


def stretches(series: NDArray, period: float, stretch: float = STRETCH) -> NDArray:
    """A series cut into stretches (stretches, samples), the last one filled with zeros."""
    length = max(1, round(stretch / period))
    count = -(-len(series) // length)
    padded = np.zeros(count * length)
    padded[: len(series)] = series
    return padded.reshape(count, length)


def _effects(point: Point, run: Linear) -> NDArray:
    """What each cause of uncertain form changes, linear in its sizes, (values, causes)."""
    causes = point.hypothesis.causes
    column = point.first_size
    own, found = 0, []
    for cause in causes:
        at, mine = slice(column, column + len(cause.sizes)), slice(own, own + len(cause.local))
        column, own = at.stop, mine.stop
        acting = point.vector[at] - np.array([size.off / size.scale for size in cause.sizes])
        change = run.slopes[:, at] @ acting + run.local[:, mine] @ run.local_value[mine]
        if not cause.exact:
            found.append(change)
    return np.stack(found, axis=1) if found else np.zeros((len(run.residual), 0))


def _misfits(fitter: Fitter, r: int, residual: NDArray, effects: NDArray) -> NDArray:
    """-2 log likelihood of one run but for a constant, for each of FORM_ERRORS; causes err apart."""
    run = fitter.plant.runs[r]
    shape = run.measured.shape
    total = np.full(len(FORM_ERRORS), float(residual @ residual))
    if not effects.shape[1]:
        return total
    for channel, changes in zip(
        residual.reshape(shape), effects.reshape(*shape, effects.shape[1]), strict=True
    ):
        r_b = stretches(channel, run.time[1])
        u_b = np.stack([stretches(change, run.time[1]) for change in changes.T], axis=2)
        squares = np.einsum("bsi,bsj->bij", u_b, u_b)
        along = np.einsum("bsi,bs->bi", u_b, r_b)
        for k, error in enumerate(FORM_ERRORS):
            gram = np.eye(u_b.shape[2]) + error**2 * squares
            allowed = error**2 * np.linalg.solve(gram, along[..., None])[..., 0]
            total[k] += np.sum(np.linalg.slogdet(gram)[1]) - np.sum(along * allowed)
    return total


def _covariance(equations: Normal) -> NDArray:
    """Of the scaled vector, all else free; wide, but finite, where the recordings say nothing."""
    size = np.sqrt(np.diag(equations.hessian) + 1e-9)  # a number may do nothing at all
    values, vectors = np.linalg.eigh(equations.hessian / np.outer(size, size))
    return (vectors / np.maximum(values, SINGULAR)) @ vectors.T / np.outer(size, size)


def _occam(point: Point, sd: NDArray) -> float:
    """What a fitted size costs: its range over what the data leave of it (Laplace)."""
    sizes = point.hypothesis.sizes
    widths = np.array([abs(size.high - size.low) / size.scale for size in sizes])
    left = np.minimum(np.sqrt(2 * np.pi) * sd[len(sd) - len(sizes) :], widths)
    return float(np.sum(np.log(widths / left)))
