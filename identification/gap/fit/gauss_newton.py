"""Damped Gauss-Newton fits (Levenberg 1944, Marquardt 1963): many hypotheses side by side."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.hypothesis import Estimate
from identification.gap.fit.linearisation import linearise
from identification.gap.fit.variable_projection import (
    LinearisedRun,
    NormalEquations,
    normal_equations,
    without_run_nuisances,
)


def fit(
    problem: FittingProblem, starts: Sequence[Estimate], rival_chi_square: float = np.inf
) -> list[Estimate]:
    """Fit every start to the fitted runs, until each fit has converged or is given up.

    Args:
        problem: readings and settings.
        starts: where the fits begin.
        rival_chi_square: least chi-square of earlier fits against which these compete [1].
    """
    if not starts:
        return []
    searches = [_Search(problem, start) for start in starts]
    active = searches
    for _ in range(problem.settings.iterations + 1):
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

    def __init__(self, problem: FittingProblem, start: Estimate):
        self.problem = problem
        self.best = start
        self.trial = start
        self.damping = problem.settings.initial_damping
        self.equations: NormalEquations | None = None

    def advance(self, runs: Sequence[LinearisedRun], rival_chi_square: float) -> None:
        """Accept or reject the trial by its linearised runs, decide whether to go on, and step."""
        equations = normal_equations(runs, self.problem.settings.largest_deviation)
        if self.equations is None or equations.chi_square < self.best.chi_square:
            self._accept(runs, equations)
            current = equations
        else:
            self._tighten()
            current = self.equations
        self.trial, decrease = self._step(current)
        self._decide(decrease, rival_chi_square)

    def _accept(self, runs: Sequence[LinearisedRun], equations: NormalEquations) -> None:
        settings = self.problem.settings
        self.damping = max(settings.damping_decrease * self.damping, settings.least_damping)
        self.equations = equations
        self.best = replace(
            self.trial,
            chi_square=equations.chi_square,
            run_values=self._stepped_run_values(runs, equations),
        )

    def _tighten(self) -> None:
        settings = self.problem.settings
        raised = settings.damping_increase * self.damping + 1e-6  # leaves zero as well
        self.damping = min(raised, settings.most_damping)

    def _stepped_run_values(self, runs: Sequence[LinearisedRun], equations: NormalEquations) -> NDArray:
        """Run parameters of the causes after one Gauss-Newton step; run offsets stay linear."""
        run_values = self.trial.run_values.copy()
        count = run_values.shape[1]
        if count:
            bound = self.problem.settings.largest_deviation
            for r, run in zip(self.problem.fitted_runs, runs, strict=True):
                step = without_run_nuisances(run, equations.tolerances, bound)[1]
                run_values[r] += step[:count]
        return run_values

    def _step(self, equations: NormalEquations) -> tuple[Estimate, float]:
        """The next trial, within the ranges, and the decrease of chi-square that it promises."""
        ends = self.problem.ends(self.best)
        step, decrease = equations.step(*ends, self.damping)
        return replace(self.best, vector=self.best.vector + step), decrease

    def _decide(self, decrease: float, rival_chi_square: float) -> None:
        """Mark the fit as converged or given up."""
        settings, readings = self.problem.settings, self.problem.readings
        excess = self.best.chi_square - readings
        enough = max(settings.converged_decrease, settings.converged_excess_share * excess)
        hopeless = (
            settings.hopeless_excess_ratio * max(rival_chi_square - readings, 0.0)
            + settings.hopeless_excess_per_reading * readings
        )
        self.best = replace(
            self.best,
            converged=bool(decrease < enough or self.damping >= 0.1 * settings.most_damping),
            given_up=bool(excess - settings.promised_decreases * decrease > hopeless),
        )
