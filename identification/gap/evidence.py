"""How well a refitted hypothesis explains the recordings: evidence that expects imperfect forms.

A cause's true form is never quite ours. So a hypothesis may miss the recordings, in every short stretch
on its own, by a share `FORM_ERROR` of what the cause itself does there: a Gaussian allowance, integrated
out in closed form. What is left of one stretch's misfit beyond that counts in full.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit import Fitter, Point
from identification.gap.normal import Linear, Normal, freed, normal

FORM_ERROR = 0.1
"""Relative standard deviation of a cause's effect, in a stretch, from what our form gives."""

STRETCH = 5e-3
"""Time over which a form's error is taken to be constant [s]."""

GENERIC = np.logspace(-4, 3, 29)
"""Variances, in noise variances, that a misfit without a name may have in a stretch."""


@dataclass(frozen=True, kw_only=True)
class Assessed:
    """A refitted hypothesis and what speaks for it."""

    point: Point
    residuals: list[NDArray]
    """Per run (channels, samples), freed of nuisances; 0 where readings are not trusted."""
    log_evidence: float
    size_sd: NDArray
    """Standard deviations of the sizes [SI]."""
    converged: bool

    @property
    def name(self) -> tuple[str, ...]:
        """The causes' labels."""
        return self.point.hypothesis.name


def assess(fitter: Fitter, points: Sequence[Point]) -> list[Assessed]:
    """Evidence of each fitted point on all runs; its vector has seen the calibration runs only.

    Tolerances and starts, which are nuisances with priors, adapt to the held-out runs as well.
    """
    found = []
    for point in points:
        runs = fitter.linearise([point], fitter.everything)[0]
        equations = normal([runs[r] for r in fitter.fitted])
        shared = normal(runs).shared
        freed_runs = [freed(run, shared)[0] for run in runs]
        log_evidence = -0.5 * sum(
            _misfit(fitter, r, residual, _effects(point, run))
            for r, (residual, run) in enumerate(zip(freed_runs, runs, strict=True))
        )
        sd = _size_sd(point, equations)
        found.append(
            Assessed(
                point=point,
                residuals=[
                    residual.reshape(fitter.plant.runs[r].measured.shape)
                    for r, residual in enumerate(freed_runs)
                ],
                log_evidence=log_evidence - _occam(point, sd),
                size_sd=sd * [size.scale for size in point.hypothesis.sizes],
                converged=point.converged,
            )
        )
    return found


def generic_log_evidence(fitter: Fitter, residuals: Sequence[NDArray]) -> float:
    """Evidence of a misfit without a name: in every stretch of a channel an offset of its own.

    Its variance is fitted for each channel (type-II likelihood, at the price of one fitted number).
    """
    total = 0.0
    for channel in range(len(residuals[0])):
        sums = [
            stretches(residual[channel], run.time[1])
            for residual, run in zip(residuals, fitter.plant.runs, strict=True)
        ]
        s = np.concatenate([np.sum(part, axis=1) for part in sums])
        n = np.concatenate([np.sum(part != 0, axis=1) for part in sums])
        squares = sum(np.sum(np.square(residual[channel])) for residual in residuals)
        gain = [np.sum(v * s**2 / (1 + v * n) - np.log1p(v * n)) for v in GENERIC]
        total += -0.5 * (squares - max(gain) + np.log(len(s)))
    return float(total)


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


def stretches(series: NDArray, period: float) -> NDArray:
    """A series cut into stretches (stretches, samples), the last one filled with zeros."""
    length = max(1, round(STRETCH / period))
    count = -(-len(series) // length)
    padded = np.zeros(count * length)
    padded[: len(series)] = series
    return padded.reshape(count, length)


def _effects(point: Point, run: Linear) -> NDArray:
    """What each cause of uncertain form changes, linear in its sizes, (values, causes)."""
    causes = point.hypothesis.causes
    column = len(point.vector) - len(point.hypothesis.sizes)
    own, found = 0, []
    for cause in causes:
        at, mine = slice(column, column + len(cause.sizes)), slice(own, own + len(cause.local))
        column, own = at.stop, mine.stop
        acting = point.vector[at] - np.array([size.off / size.scale for size in cause.sizes])
        change = run.slopes[:, at] @ acting + run.local[:, mine] @ run.local_value[mine]
        if not cause.exact:
            found.append(change)
    return np.stack(found, axis=1) if found else np.zeros((len(run.residual), 0))


def _misfit(fitter: Fitter, r: int, residual: NDArray, effects: NDArray) -> float:
    """-2 log likelihood of one run, but for a constant; every cause errs on its own."""
    run = fitter.plant.runs[r]
    shape = run.measured.shape
    total = float(residual @ residual)
    for channel, changes in zip(
        residual.reshape(shape), effects.reshape(*shape, effects.shape[1]), strict=True
    ):
        r_b = stretches(channel, run.time[1])
        u_b = FORM_ERROR * np.stack(
            [stretches(change, run.time[1]) for change in changes.T] or [0.0 * r_b], axis=2
        )
        gram = np.eye(u_b.shape[2]) + np.einsum("bsi,bsj->bij", u_b, u_b)
        along = np.einsum("bsi,bs->bi", u_b, r_b)
        explained = np.einsum("bi,bi->b", along, np.linalg.solve(gram, along[..., None])[..., 0])
        total += float(np.sum(np.linalg.slogdet(gram)[1] - explained))
    return total


def _size_sd(point: Point, equations: Normal) -> NDArray:
    """Standard deviations of the scaled sizes, all else free."""
    k, sizes = len(point.vector), len(point.hypothesis.sizes)
    covariance = np.linalg.inv(equations.hessian + 1e-9 * np.eye(k))
    return np.sqrt(np.diag(covariance)[k - sizes :])


def _occam(point: Point, sd: NDArray) -> float:
    """What a fitted size costs: its range over what the data leave of it (Laplace)."""
    sizes = point.hypothesis.sizes
    widths = np.array([abs(size.high - size.low) / size.scale for size in sizes])
    left = np.minimum(np.sqrt(2 * np.pi) * sd, widths)
    return float(np.sum(np.log(widths / left)))
