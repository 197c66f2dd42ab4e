"""Screening: causes with a threshold begin where they are seen; pairs are ordered as by brute force."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from identification.gap.fitting_problem import Estimate, Hypothesis
from identification.gap.gauss_newton import fit, linearise
from identification.gap.plant import Cause, FreeParameter
from identification.gap.recalibration import recalibrate, refit
from identification.gap.screening import (
    CauseSignature,
    Start,
    _predicted,
    promising_pairs,
    screen_causes,
    simulate_signatures,
    with_cause,
)
from identification.gap.variable_projection import ChangedRuns, LinearisedRun
from tests.identification.gap.drives import Drive


def screened(every_start: bool = False) -> list[Start]:
    """A drive that is limited at 0.8, and has a limit at 0.7 as the only trial."""
    problem, base = recalibrate(Drive({"limit": 0.8}))
    runs = linearise(problem, [base], problem.fitted_runs)[0]
    signatures = simulate_signatures(problem, base, problem.plant.causes)
    return screen_causes(problem, base, runs, signatures, every_start=every_start)


def test_a_threshold_begins_at_its_trial_where_a_linear_step_leads_to_off():
    problem, base = recalibrate(Drive({"limit": 0.8}))
    runs = linearise(problem, [base], problem.fitted_runs)[0]
    (limit,) = [cause for cause in problem.plant.causes if cause.name == "limit"]
    signatures = simulate_signatures(problem, base, [limit])
    changed = ChangedRuns(runs, [signatures[0].changes])
    predicted = _predicted(changed.with_slope(0), signatures[0])[1]
    assert predicted["limit"] > 1.0  # beyond the largest command: no effect, and no slope either
    (stuck,) = fit(problem, [with_cause(problem, base, limit, predicted)])
    (start,) = screen_causes(problem, base, runs, signatures)
    (found,) = refit(problem, base, [start])
    assert problem.values(found)["limit"] == pytest.approx(0.8, abs=0.02)
    assert problem.values(stuck)["limit"] > 1.0
    assert found.chi_square < 0.5 * stuck.chi_square


def test_the_most_promising_cause_comes_first_and_each_cause_once():
    found = screened()
    assert [start.chi_square for start in found] == sorted(start.chi_square for start in found)
    names = [start.cause.name for start in found]
    assert len(names) == len(set(names)) == 6


def runs_and_signatures(seed: int) -> tuple[list[LinearisedRun], list[CauseSignature]]:
    """Four causes: the first two differ in little, and that little is what the readings show."""
    rng = np.random.default_rng(seed)
    causes = [
        Cause(
            name=name,
            component="",
            parameters=(FreeParameter(symbol=name, unit="1", low=0.0, high=9.0, trials=(1.0,)),),
        )
        for name in "abcd"
    ]
    tried = Estimate(hypothesis=Hypothesis(causes=()), vector=np.ones(1), run_values=np.zeros((2, 0)))
    runs, changes = [], []
    for _ in range(2):
        shared, little = 10 * rng.normal(size=60), rng.normal(size=60)
        own = [shared + little, little - shared, *rng.normal(size=(2, 60))]
        changes.append(own)
        runs.append(
            LinearisedRun(
                residual=4 * little + own[2] + 0.5 * own[3] + rng.normal(size=60),
                slopes=rng.normal(size=(60, 2)), run_slopes=rng.normal(size=(60, 1)),
                run_values=np.zeros(1), run_sd=np.ones(1), tolerance_slopes=np.zeros((60, 0)),
            )
        )  # fmt: skip
    signatures = [
        CauseSignature(cause=cause, estimate=tried, changes=[own[i] for own in changes])
        for i, cause in enumerate(causes)
    ]
    return runs, signatures


def squares_left(runs: Sequence[LinearisedRun], columns: Sequence[Sequence[np.ndarray]]) -> float:
    """Least sum of squares with columns whose sizes are positive, all numbers in one problem."""
    rows, right = [], []
    for r, run in enumerate(runs):
        own = np.zeros((60, len(runs)))
        own[:, r] = run.run_slopes[:, 0]
        rows.append(np.column_stack([*(column[r] for column in columns), run.slopes, own]))
        right.append(run.residual)
    prior = np.zeros((len(runs), rows[0].shape[1]))
    prior[:, -len(runs) :] = np.eye(len(runs))
    low = np.full(prior.shape[1], -np.inf)
    low[: len(columns)] = 0.0
    whole = np.vstack([*rows, prior]), np.concatenate([*right, np.zeros(len(runs))])
    return 2 * lsq_linear(*whole, (low, np.full(len(low), np.inf)), method="bvls").cost


@pytest.mark.parametrize("seed", range(2))
def test_pairs_come_in_the_order_of_what_they_leave_together(seed):
    runs, signatures = runs_and_signatures(seed)
    own = {signature.cause.label: signature.changes for signature in signatures}
    left = {
        frozenset(pair): squares_left(runs, [own[label] for label in pair])
        for pair in combinations(own, 2)
    }
    found = promising_pairs(runs, signatures)
    assert found == [pair for pair in sorted(left, key=lambda pair: left[pair]) if pair in found]
    assert found[0] == min(left, key=lambda pair: left[pair]) == frozenset("ab")


def test_variants_of_one_cause_make_no_pair():
    runs, signatures = runs_and_signatures(0)
    variants = [replace(s, cause=replace(s.cause, name="a", variant=s.cause.name)) for s in signatures]
    assert promising_pairs(runs, variants) == []
