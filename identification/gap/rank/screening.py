"""Screening: which causes are worth a refit, and from which values, by simulation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.hypothesis import Estimate, Hypothesis
from identification.gap.fit.variable_projection import (
    LinearisedRun,
    NormalEquations,
    normal_equations,
)
from identification.gap.model.cause import Cause


@dataclass(frozen=True, kw_only=True)
class ScreenedCause:
    """A cause at its most promising trial values."""

    cause: Cause
    values: tuple[float, ...]
    """Values of the cause's parameters from which a refit begins, within their ranges [SI]."""
    chi_square: float
    """Sum of squares that they leave on the fitted runs [1]."""

    @property
    def by_symbol(self) -> dict[str, float]:
        """The values by symbol [SI]."""
        return {p.symbol: v for p, v in zip(self.cause.parameters, self.values, strict=True)}


@dataclass(frozen=True, kw_only=True)
class CauseSignature:
    """Change of the outputs by a cause at one of its trial values, beside a base estimate."""

    cause: Cause
    estimate: Estimate
    """The base estimate with the cause."""
    changes: list[NDArray]
    """Per fitted run, (values,) [noise deviations]."""


def trial_estimates(
    problem: FittingProblem, base: Estimate, causes: Sequence[Cause]
) -> list[tuple[Cause, Estimate]]:
    """The base estimate with each cause added at each of its trial values."""
    trials = []
    for cause in causes:
        for trial in range(max(len(p.trials) for p in cause.parameters)):
            at = {p.symbol: p.trials[min(trial, len(p.trials) - 1)] for p in cause.parameters}
            trials.append((cause, with_cause(problem, base, cause, at)))
    return trials


def with_cause(
    problem: FittingProblem, base: Estimate, cause: Cause, values: Mapping[str, float]
) -> Estimate:
    """The base estimate with another cause, whose parameters have these values [SI] by symbol."""
    joint = Hypothesis(causes=(*base.hypothesis.causes, cause))
    start = problem.start(joint, {**problem.values(base), **values})
    start.run_values[:, : base.run_values.shape[1]] = base.run_values
    return replace(start, slopes=base.slopes)


def simulate_signatures(
    problem: FittingProblem, base: Estimate, causes: Sequence[Cause]
) -> list[CauseSignature]:
    """Signatures of every cause at each of its trial values, all simulated side by side."""
    trials = trial_estimates(problem, base, causes)
    residuals = problem.residuals([base, *(estimate for _, estimate in trials)], problem.fitted_runs)
    return [
        CauseSignature(
            cause=cause,
            estimate=estimate,
            changes=[block[:, 0] - block[:, 1 + k] for block in residuals],
        )
        for k, (cause, estimate) in enumerate(trials)
    ]


def screen_causes(
    problem: FittingProblem,
    base: Estimate,
    base_runs: Sequence[LinearisedRun],
    signatures: Sequence[CauseSignature],
    every_start: bool = False,
) -> list[ScreenedCause]:
    """The best start of every cause beside the base estimate, the most promising cause first.

    A start is a trial value, or what one linear step from a trial predicts. Both are simulated,
    as a cause with a threshold is far from linear; calibrated and nuisance parameters adapt linearly.

    Args:
        problem: readings and settings.
        base: the estimate to which the causes are added.
        base_runs: the base estimate linearised in the fitted runs.
        signatures: from `simulate_signatures` beside the same base.
        every_start: return all starts of each cause, not only the best.
    """
    bound = problem.settings.largest_deviation
    tried = [_at_trial(base_runs, signature, bound) for signature in signatures]
    predicted = [_predicted(base_runs, signature, bound) for signature in signatures]
    stepped = _simulated(problem, base, base_runs, list(_best_of_each(predicted).values()))
    starts = [*tried, *stepped]
    kept = starts if every_start else _best_of_each(starts).values()
    return sorted(kept, key=lambda screened: screened.chi_square)


def _best_of_each(screened: Sequence[ScreenedCause]) -> dict[str, ScreenedCause]:
    """The start with the least chi-square by label of the cause."""
    best: dict[str, ScreenedCause] = {}
    for each in screened:
        label = each.cause.label
        if label not in best or each.chi_square < best[label].chi_square:
            best[label] = each
    return best


def _simulated(
    problem: FittingProblem,
    base: Estimate,
    base_runs: Sequence[LinearisedRun],
    starts: Sequence[ScreenedCause],
) -> list[ScreenedCause]:
    """Starts with the chi-square that their simulation leaves."""
    estimates = [with_cause(problem, base, start.cause, start.by_symbol) for start in starts]
    residuals = problem.residuals([base, *estimates], problem.fitted_runs)
    bound = problem.settings.largest_deviation
    return [
        replace(
            start,
            chi_square=_chi_square(
                base_runs, [block[:, 0] - block[:, 1 + k] for block in residuals], bound
            ),
        )
        for k, start in enumerate(starts)
    ]


def _at_trial(
    base_runs: Sequence[LinearisedRun], signature: CauseSignature, largest_deviation: float
) -> ScreenedCause:
    """A cause at its trial values."""
    parameters, vector = signature.cause.parameters, signature.estimate.vector
    values = vector[len(vector) - len(parameters) :] * [p.scale for p in parameters]
    return ScreenedCause(
        cause=signature.cause,
        values=tuple(values.tolist()),
        chi_square=_chi_square(base_runs, signature.changes, largest_deviation),
    )


def _chi_square(
    base_runs: Sequence[LinearisedRun], changes: Sequence[NDArray], largest_deviation: float
) -> float:
    """Sum of squares that a change of the outputs leaves, calibrated parameters adapted linearly [1].

    changes: per run (values,) [noise deviations].
    """
    runs = [
        replace(run, residual=run.residual - change)
        for run, change in zip(base_runs, changes, strict=True)
    ]
    equations = normal_equations(runs, largest_deviation)
    hessian = equations.hessian + 1e-9 * np.eye(len(equations.gradient))
    return equations.least - float(equations.gradient @ np.linalg.solve(hessian, equations.gradient))


def _predicted(
    base_runs: Sequence[LinearisedRun], signature: CauseSignature, largest_deviation: float
) -> ScreenedCause:
    """One signature, proportional to the cause's parameters with either sign, fitted to the residual."""
    runs = [
        replace(run, slopes=np.column_stack([run.slopes, change]))
        for run, change in zip(base_runs, signature.changes, strict=True)
    ]
    equations = normal_equations(runs, largest_deviation)
    parameters, vector = signature.cause.parameters, signature.estimate.vector
    trial = vector[len(vector) - len(parameters) :] * [p.scale for p in parameters]
    nominal = np.array([p.nominal for p in parameters])
    ends = np.array([(p.low - n, p.high - n) for p, n in zip(parameters, nominal, strict=True)])
    shares = ends / (trial - nominal)[:, None]
    low, high = np.max(np.min(shares, axis=1)), np.min(np.max(shares, axis=1))
    share, chi_square = _bounded_last_step(equations, low, high)
    values = tuple((nominal + share * (trial - nominal)).tolist())
    return ScreenedCause(cause=signature.cause, values=values, chi_square=chi_square)


def _bounded_last_step(equations: NormalEquations, low: float, high: float) -> tuple[float, float]:
    """Least-squares step of the last number between low and high [1], and the chi-square that it leaves.

    All other numbers of the vector are free.
    """
    hessian, gradient = equations.hessian, equations.gradient
    k = len(gradient) - 1
    others = hessian[:k, :k] + 1e-9 * np.eye(k)
    solved = np.linalg.solve(others, np.column_stack([gradient[:k], hessian[:k, k]]))
    curvature = hessian[k, k] - hessian[k, :k] @ solved[:, 1]
    slope = gradient[k] - hessian[k, :k] @ solved[:, 0]
    step = float(np.clip(slope / max(curvature, 1e-12), low, high))
    left = equations.least - gradient[:k] @ solved[:, 0] - 2 * step * slope + step * step * curvature
    return step, float(left)
