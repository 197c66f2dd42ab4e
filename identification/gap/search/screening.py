"""Screening: which causes are worth a refit, and from which values, by simulation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import Estimate, FittingProblem, cause_places
from identification.gap.fit.variable_projection import (
    RIDGE,
    ChangedRuns,
    LinearisedRun,
    NormalEquations,
    bounded_minimiser,
    normal_equations,
)
from identification.gap.plant import Cause


@dataclass(frozen=True, kw_only=True)
class Start:
    """Where the refit of a set of causes begins."""

    estimate: Estimate
    """The causes at trial or predicted values, calibrated parameters adapted to them."""
    chi_square: float
    """Sum of squares that it leaves on the fitted runs, but for the calibrated parameters' curvature
    [1]."""

    @property
    def labels(self) -> frozenset[str]:
        """Labels of the causes."""
        return frozenset(self.estimate.hypothesis.labels)

    @property
    def cause(self) -> Cause:
        """The cause that was added last."""
        return self.estimate.hypothesis.causes[-1]


@dataclass(frozen=True, kw_only=True)
class CauseSignature:
    """Change of the outputs by a cause at one of its trial values, beside a base estimate."""

    cause: Cause
    estimate: Estimate
    """The base estimate with the cause."""
    changes: list[NDArray]
    """Per fitted run, (values,) [noise deviations]."""

    @property
    def trial(self) -> NDArray:
        """The trial values of the cause's parameters, (parameters,) [SI]."""
        place = next(place for cause, place, _ in cause_places(self.estimate) if cause is self.cause)
        return self.estimate.vector[place] * [p.scale for p in self.cause.parameters]

    @property
    def shares(self) -> tuple[float, float]:
        """Least and largest multiple of the trial at which no parameter leaves its range [1]."""
        sizes = self.cause.sizes
        nominal = np.array([p.nominal for p in sizes])
        trial = dict(zip((p.symbol for p in self.cause.parameters), self.trial, strict=True))
        ends = np.array([(p.low, p.high) for p in sizes]) - nominal[:, None]
        shares = ends / (np.array([trial[p.symbol] for p in sizes]) - nominal)[:, None]
        return float(np.max(np.min(shares, axis=1))), float(np.min(np.max(shares, axis=1)))

    def values_at(self, share: float) -> dict[str, float]:
        """The cause's values by symbol [SI] where it changes the outputs by a share of the trial [1]."""
        return {
            p.symbol: float(p.nominal + share * (trial - p.nominal))
            for p, trial in zip(self.cause.parameters, self.trial, strict=True)
        }


def with_cause(
    problem: FittingProblem, base: Estimate, cause: Cause, values: Mapping[str, float]
) -> Estimate:
    """The base estimate with another cause, whose parameters have these values [SI] by symbol."""
    joint = replace(base.hypothesis, causes=(*base.hypothesis.causes, cause))
    start = problem.start(joint, {**problem.values(base), **values})
    start.run_values[:, : base.run_values.shape[1]] = base.run_values
    return replace(start, slopes=base.slopes)


def simulate_signatures(
    problem: FittingProblem, base: Estimate, causes: Sequence[Cause]
) -> list[CauseSignature]:
    """Signatures of every cause at each of its trial values, all simulated side by side."""
    trials = []
    for cause in causes:
        for trial in range(max(len(p.trials) for p in cause.sizes)):
            at = {p.symbol: p.trials[min(trial, len(p.trials) - 1)] for p in cause.sizes}
            trials.append((cause, with_cause(problem, base, cause, at)))
    changes = changes_of(problem, base, [estimate for _, estimate in trials])
    return [
        CauseSignature(cause=cause, estimate=estimate, changes=own)
        for (cause, estimate), own in zip(trials, changes, strict=True)
    ]


def changes_of(
    problem: FittingProblem, base: Estimate, estimates: Sequence[Estimate]
) -> list[list[NDArray]]:
    """How the outputs of each estimate differ from the base's: per fitted run, (values,) [noise
    deviations]; all are simulated side by side."""
    if not estimates:
        return []
    residuals = problem.residuals([base, *estimates], problem.fitted_runs)
    return [[block[:, 0] - block[:, 1 + k] for block in residuals] for k in range(len(estimates))]


def screen_causes(
    problem: FittingProblem,
    base: Estimate,
    base_runs: Sequence[LinearisedRun],
    signatures: Sequence[CauseSignature],
) -> list[Start]:
    """The best start of every cause beside the base estimate, the most promising cause first.

    A start is a trial value, or what one linear step from a trial predicts. Both are simulated, as a
    cause with a threshold is far from linear; calibrated and nuisance parameters adapt linearly.

    Args:
        problem: the plant with its readings.
        base: the estimate to which the causes are added.
        base_runs: the same linearised in the fitted runs.
        signatures: from `simulate_signatures` beside the same base.
    """
    if not signatures:
        return []
    changes = [signature.changes for signature in signatures]
    changed = ChangedRuns(base_runs, changes)
    tried = [
        _adapted(problem, base, signature.estimate, changed.explained(i))
        for i, signature in enumerate(signatures)
    ]
    nearest: dict[str, tuple[float, Estimate]] = {}
    for i, signature in enumerate(signatures):
        chi_square, values = _predicted(changed.with_slope(i), signature)
        label = signature.cause.label
        if label not in nearest or chi_square < nearest[label][0]:
            nearest[label] = chi_square, with_cause(problem, base, signature.cause, values)
    predicted = [estimate for _, estimate in nearest.values()]
    starts = [*tried, *simulated_starts(problem, base, base_runs, predicted)]
    return sorted(best_start_of_each(starts), key=lambda start: start.chi_square)


def best_start_of_each(starts: Sequence[Start]) -> list[Start]:
    """The start with the least chi-square of each set of causes."""
    best: dict[frozenset[str], Start] = {}
    for each in starts:
        if each.labels not in best or each.chi_square < best[each.labels].chi_square:
            best[each.labels] = each
    return list(best.values())


def simulated_starts(
    problem: FittingProblem,
    base: Estimate,
    base_runs: Sequence[LinearisedRun],
    estimates: Sequence[Estimate],
) -> list[Start]:
    """Starts at estimates that add causes to the base."""
    if not estimates:
        return []
    changed = ChangedRuns(base_runs, changes_of(problem, base, estimates))
    return [
        _adapted(problem, base, estimate, changed.explained(k)) for k, estimate in enumerate(estimates)
    ]


def _adapted(
    problem: FittingProblem, base: Estimate, estimate: Estimate, equations: NormalEquations
) -> Start:
    """An estimate that adds causes to the base, the base's own parameters adapted by one linear step.

    equations: of the base's parameters, with the causes' changes of the outputs.
    """
    step, decrease = equations.step(*problem.ends(base), damping=0.0)
    vector = estimate.vector.copy()
    vector[: len(step)] += step
    return Start(estimate=replace(estimate, vector=vector), chi_square=equations.chi_square - decrease)


def _predicted(equations: NormalEquations, signature: CauseSignature) -> tuple[float, dict[str, float]]:
    """Predicted chi-square [1] of a signature that is fitted to the residual, and values by symbol [SI].

    The signature is taken as proportional to the cause's parameters, with either sign.

    equations: with the signature's changes as the last slope.
    """
    share, chi_square = _bounded_last_step(equations, *signature.shares)
    return chi_square, signature.values_at(share)


def _bounded_last_step(equations: NormalEquations, low: float, high: float) -> tuple[float, float]:
    """Least-squares step of the last number between low and high [1], and the chi-square that it leaves.

    All other numbers of the vector are free.
    """
    curvature, slope, explained = _without_first(equations, len(equations.gradient) - 1)
    step = float(np.clip(slope[0] / (curvature[0, 0] + RIDGE), low, high))
    left = equations.chi_square - explained - 2 * step * slope[0] + step * step * curvature[0, 0]
    return step, float(left)


def _without_first(equations: NormalEquations, k: int) -> tuple[NDArray, NDArray, float]:
    """Hessian and gradient of the numbers behind the first k, which are minimised over; what these
    explain of the chi-square [1]."""
    hessian, gradient = equations.hessian, equations.gradient
    cross = hessian[:k, k:]
    own = hessian[:k, :k] + RIDGE * np.eye(k)
    solved = np.linalg.solve(own, np.column_stack([cross, gradient[:k]]))
    reduced = gradient[k:] - cross.T @ solved[:, -1]
    return hessian[k:, k:] - cross.T @ solved[:, :-1], reduced, float(gradient[:k] @ solved[:, -1])


def with_changes(run: LinearisedRun, changes: Sequence[NDArray]) -> LinearisedRun:
    """The run with changes of its outputs (values,) as further slopes, which have no prior."""
    none = np.zeros(len(changes))
    return replace(
        run,
        slopes=np.column_stack([run.slopes, *changes]),
        slope_precision=np.append(run.slope_precision, none),
        slope_values=np.append(run.slope_values, none),
    )


def best_pairs(
    base_runs: Sequence[LinearisedRun], signatures: Sequence[CauseSignature], most: int
) -> list[list[tuple[Cause, dict[str, float]]]]:
    """The pairs of causes that promise most together, each cause with its values by symbol [SI].

    base_runs: the base estimate linearised in the fitted runs. signatures: beside the same base.
    """
    gram, moment = without_base(base_runs, signatures)
    shares = np.array([signature.shares for signature in signatures])
    found = []
    for pair in combinations(range(len(signatures)), 2):
        if signatures[pair[0]].cause.name != signatures[pair[1]].cause.name:
            own = np.array(pair)
            part = gram[np.ix_(own, own)]
            best = bounded_minimiser(part + RIDGE * np.eye(2), moment[own], *shares[own].T)
            found.append((float(best @ part @ best - 2.0 * best @ moment[own]), pair, best))
    of_causes: dict[frozenset[str], tuple] = {}
    for each in sorted(found, key=lambda each: each[0]):
        of_causes.setdefault(frozenset(signatures[i].cause.label for i in each[1]), each)
    return [
        [
            (signatures[i].cause, signatures[i].values_at(share))
            for i, share in zip(pair, best, strict=True)
        ]
        for _, pair, best in list(of_causes.values())[:most]
    ]


def without_base(
    base_runs: Sequence[LinearisedRun], signatures: Sequence[CauseSignature]
) -> tuple[NDArray, NDArray]:
    """Gram matrix (n, n) of n signatures and their products with the residual (n,), the base's own
    parameters and all nuisances minimised over [1]."""
    runs = [
        with_changes(run, [signature.changes[r] for signature in signatures])
        for r, run in enumerate(base_runs)
    ]
    return _without_first(normal_equations(runs), base_runs[0].slopes.shape[1])[:2]
