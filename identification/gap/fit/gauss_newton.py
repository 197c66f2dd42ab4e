"""Damped Gauss-Newton fits (Levenberg 1944, Marquardt 1963): many hypotheses side by side.

Estimates are linearised by finite differences, all candidates in one simulation.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import Estimate, FittingProblem, NuisanceSlopes
from identification.gap.fit.variable_projection import (
    LinearisedRun,
    NormalEquations,
    normal_equations,
    without_run_nuisances,
)
from identification.gap.plant import noise_weighted

FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 0.1, 1e-6, 1e6
"""Damping of Levenberg and Marquardt relative to the diagonal [1]: nearly none at first, as starts are
expected to be close; a fit ends at the greatest, where a step is too short to gain anything."""


def linearise(
    problem: FittingProblem, estimates: Sequence[Estimate], runs: Sequence[int]
) -> list[list[LinearisedRun]]:
    """Residuals and derivatives of each estimate in each of the runs."""
    changed = [_changed(problem, estimate) for estimate in estimates]
    ends = np.cumsum([0, *(len(each) for each in changed)])
    outputs = problem.outputs([candidate for each in changed for candidate in each], runs)
    return [
        [
            _linearised(problem, estimate, r, block[:, first:last])
            for r, block in zip(runs, outputs, strict=True)
        ]
        for estimate, first, last in zip(estimates, ends[:-1], ends[1:], strict=True)
    ]


def _changed(problem: FittingProblem, estimate: Estimate) -> list[Estimate]:
    """The estimate, then a copy for each parameter and run parameter, changed by its step.

    Calibrated parameters whose derivatives are kept are left out.
    """
    candidates = [estimate]
    for i, step in list(enumerate(_steps(problem, estimate)))[_kept(problem, estimate) :]:
        vector = estimate.vector.copy()
        vector[i] += step
        candidates.append(replace(estimate, vector=vector))
    for j, nuisance in enumerate(estimate.hypothesis.run_parameters):
        run_values = estimate.run_values.copy()
        run_values[:, j] += nuisance.step
        candidates.append(replace(estimate, run_values=run_values))
    return candidates


def _kept(problem: FittingProblem, estimate: Estimate) -> int:
    """Number of calibrated parameters whose derivatives are kept."""
    return 0 if problem.slopes_of(estimate).calibrated is None else len(problem.plant.parameters)


def _steps(problem: FittingProblem, estimate: Estimate) -> NDArray:
    """Finite differences of the scaled vector (k,) [1], away from the nearer end of each range."""
    middle = np.array([0.5 * (p.low + p.high) / p.scale for p in problem.parameters(estimate)])
    sizes = np.maximum(np.abs(estimate.vector), 0.1)  # a cause that does not act yet has the value 0
    sd = np.array([p.sd / p.scale for p in problem.parameters(estimate)])
    # Large against rounding of the simulation, small against the outputs' curvature; 0.02 standard
    # deviations of a law change a strength by a percent.
    steps = np.where(np.isfinite(sd), 0.02 * sd, 1e-3 * sizes)
    return np.where(estimate.vector > middle, -steps, steps)


def _linearised(
    problem: FittingProblem, estimate: Estimate, run: int, outputs: NDArray
) -> LinearisedRun:
    """One run from the weighted outputs (values, 1 + k + l) of the changed estimates."""
    kept, steps = _kept(problem, estimate), _steps(problem, estimate)
    calibrated, k = problem.slopes_of(estimate).calibrated, len(steps) - kept
    changes = np.nan_to_num(outputs[:, 1:] - outputs[:, :1])
    slopes = changes[:, :k] / steps[kept:]
    return linearised_run(
        problem,
        estimate,
        run,
        outputs[:, 0],
        slopes=slopes if calibrated is None else np.column_stack([calibrated[run], slopes]),
        run_slopes=changes[:, k:] / [n.step for n in estimate.hypothesis.run_parameters],
        run_values=estimate.run_values[run],
    )


def linearised_run(
    problem: FittingProblem,
    estimate: Estimate,
    run: int,
    outputs: NDArray,
    *,
    slopes: NDArray,
    run_slopes: NDArray,
    run_values: NDArray,
) -> LinearisedRun:
    """One run from outputs and derivatives, with the nuisance slopes of the estimate.

    Args:
        problem: the readings.
        estimate: where the run is linearised.
        run: index of the run.
        outputs: weighted outputs, (values,) [noise deviations].
        slopes: their derivatives by the scaled vector, (values, k).
        run_slopes: their derivatives by the run parameters, (values, l).
        run_values: the run parameters less their centres, (l,) [SI].
    """
    nuisances = problem.slopes_of(estimate)
    offset_slopes, shared_slopes = nuisances.offset_slopes[run], nuisances.tolerance_slopes[run]
    offsets = offset_slopes.shape[1]
    run_parameters = estimate.hypothesis.run_parameters
    known = (*run_parameters, *problem.plant.run_offsets[:offsets])
    # The slopes describe tolerances from their centres: their part in the simulation is undone.
    undone = shared_slopes @ nuisances.deviations
    precision, values = problem.priors(estimate)
    return LinearisedRun(
        residual=problem.residual(run, outputs[:, None])[:, 0] + undone,
        slopes=slopes,
        slope_precision=precision[: slopes.shape[1]],
        slope_values=values[: slopes.shape[1]],
        run_slopes=np.column_stack([run_slopes, offset_slopes]),
        run_values=np.concatenate([run_values, np.zeros(offsets)]),
        run_sd=np.array([nuisance.sd for nuisance in known]),
        shared_slopes=shared_slopes,
    )


def nuisance_slopes(
    problem: FittingProblem, estimates: Sequence[Estimate], deviations: Sequence[NDArray]
) -> list[NuisanceSlopes]:
    """Derivatives by nuisances and calibrated parameters at each estimate, over all runs.

    Args:
        problem: the plant.
        estimates: where the derivatives are taken.
        deviations: tolerances of each estimate, (m,) [standard deviations from the centres].
    """
    plant = problem.plant
    nuisances = (*plant.run_offsets, *plant.tolerances)
    n, offsets = 1 + len(nuisances), len(plant.run_offsets)
    all_slopes = [
        NuisanceSlopes(deviations=d, offset_slopes=[], tolerance_slopes=[]) for d in deviations
    ]
    placed = [replace(e, slopes=slopes) for e, slopes in zip(estimates, all_slopes, strict=True)]
    values = problem.candidates([estimate for estimate in placed for _ in range(n)])
    for j, nuisance in enumerate(nuisances, start=1):
        centre = np.full(n * len(estimates), nuisance.centre, dtype=float)
        values.setdefault(nuisance.symbol, centre)[j::n] += nuisance.step
    steps = np.array([nuisance.step for nuisance in nuisances])
    sd = np.array([nuisance.sd for nuisance in plant.tolerances])
    for r, output in enumerate(plant.outputs(values, problem.all_runs)):
        outputs = noise_weighted(plant, r, output).reshape(-1, len(estimates), n)
        slopes = np.nan_to_num(outputs[..., 1:] - outputs[..., :1]) / steps
        for each, own in zip(all_slopes, slopes.transpose(1, 0, 2), strict=True):
            each.offset_slopes.append(own[:, :offsets])
            each.tolerance_slopes.append(own[:, offsets:] * sd)
    count = len(plant.parameters)
    calibrated = [
        [run.slopes[:, :count] for run in runs] for runs in linearise(problem, placed, problem.all_runs)
    ]
    return [replace(each, calibrated=own) for each, own in zip(all_slopes, calibrated, strict=True)]


def fit(
    problem: FittingProblem,
    starts: Sequence[Estimate],
    rival_chi_square: float = np.inf,
    iterations: int = 20,
    precision: float = 1.0,
) -> list[Estimate]:
    """Fit every start to the fitted runs, until each fit has converged or is given up.

    Args:
        problem: readings and settings.
        starts: where the fits begin.
        rival_chi_square: least chi-square of earlier fits against which these compete [1].
        iterations: most of them, for computing time; a fit that needs more is weighed as it is and
            reported as not converged.
        precision: decrease of chi-square at which a fit ends, relative to that at which nothing that
            is judged changes [1].
    """
    if not starts:
        return []
    searches = [_Search(problem, start, precision) for start in starts]
    active = searches
    for _ in range(iterations + 1):
        linearised = linearise(problem, [search.trial for search in active], problem.fitted_runs)
        for search, runs in zip(active, linearised, strict=True):
            search.advance(runs, rival_chi_square)
        rival_chi_square = min(rival_chi_square, *(search.best.chi_square for search in searches))
        active = [s for s in active if not (s.best.converged or s.best.given_up)]
        if not active:
            break
    return [search.best for search in searches]


class _Search:
    """The fit of one hypothesis."""

    def __init__(self, problem: FittingProblem, start: Estimate, precision: float):
        self.problem, self.precision = problem, precision
        self.best = start
        self.trial = start
        self.damping = FIRST_DAMPING
        self.equations: NormalEquations | None = None

    def advance(self, runs: Sequence[LinearisedRun], rival_chi_square: float) -> None:
        """Accept or reject the trial by its linearised runs, decide whether to go on, and step."""
        equations = normal_equations(runs)
        if self.equations is None or equations.chi_square < self.best.chi_square:
            self._accept(runs, equations)
            current = equations
        elif self.problem.slopes_of(self.best).calibrated is not None:
            # Return to the best estimate, from now on with derivatives of all parameters.
            slopes = replace(self.problem.slopes_of(self.best), calibrated=None)
            self.best = replace(self.best, slopes=slopes)
            self.trial, self.equations = self.best, None
            return
        else:
            self.damping = min(10.0 * self.damping, MOST_DAMPING)  # Marquardt 1963
            current = self.equations
        step, decrease = current.step(*self.problem.ends(self.best), self.damping)
        self.trial = replace(self.best, vector=self.best.vector + step, steps=self.best.steps + 1)
        self._decide(decrease, rival_chi_square)

    def _accept(self, runs: Sequence[LinearisedRun], equations: NormalEquations) -> None:
        self.damping = max(self.damping / 10.0, LEAST_DAMPING)
        self.equations = equations
        # Run parameters of the causes take the step as well; run offsets stay linear.
        run_values = self.trial.run_values.copy()
        if count := run_values.shape[1]:
            for r, run in zip(self.problem.fitted_runs, runs, strict=True):
                run_values[r] += without_run_nuisances(run, equations.shared)[1][:count]
        self.best = replace(self.trial, chi_square=equations.chi_square, run_values=run_values)

    def _decide(self, decrease: float, rival_chi_square: float) -> None:
        """Mark the fit as converged, or as given up for computing time."""
        readings = self.problem.readings
        excess = self.best.chi_square - readings
        # A decrease of 0.3 changes no odds, and a cause that leaves much need not be fitted to the last
        # digit.
        enough = self.precision * max(0.3, 1e-3 * excess)
        # A rival is far better; noise is not known to the percent.
        hopeless = 3.0 * max(rival_chi_square - readings, 0.0) + 0.05 * readings
        self.best = replace(
            self.best,
            converged=bool(decrease < enough or self.damping == MOST_DAMPING),
            # Steps of a nonlinear model gain more than they predict at first.
            given_up=bool(excess - 3.0 * decrease > hopeless),
        )
