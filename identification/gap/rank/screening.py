"""Screening: which causes are worth a refit, from the signature of each, linearised once."""

from collections.abc import Sequence
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
    """Predicted values of the cause's parameters, within their ranges [SI]."""
    chi_square: float
    """Predicted sum of squares on the fitted runs [1]."""


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
    values = problem.values(base)
    for cause in causes:
        joint = Hypothesis(causes=(*base.hypothesis.causes, cause))
        for trial in range(max(len(p.trials) for p in cause.parameters)):
            at = {p.symbol: p.trials[min(trial, len(p.trials) - 1)] for p in cause.parameters}
            trials.append((cause, problem.start(joint, {**values, **at})))
    return trials


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
    base_runs: Sequence[LinearisedRun],
    signatures: Sequence[CauseSignature],
    largest_deviation: float,
) -> list[ScreenedCause]:
    """The best trial of every cause beside the base estimate, the most promising cause first.

    The signature is taken as proportional to the cause's parameters, with either sign. It is fitted to
    the residual of the base together with the calibrated parameters and all nuisance parameters.

    Args:
        base_runs: the base estimate linearised in the fitted runs.
        signatures: from `simulate_signatures` beside the same base.
        largest_deviation: bound of nuisance parameters [standard deviations].
    """
    best: dict[str, ScreenedCause] = {}
    for signature in signatures:
        screened = _screened(base_runs, signature, largest_deviation)
        label = signature.cause.label
        if label not in best or screened.chi_square < best[label].chi_square:
            best[label] = screened
    return sorted(best.values(), key=lambda screened: screened.chi_square)


def _screened(
    base_runs: Sequence[LinearisedRun], signature: CauseSignature, largest_deviation: float
) -> ScreenedCause:
    """One signature fitted to the base's residual."""
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
