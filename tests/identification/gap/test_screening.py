"""Screening: causes with a threshold begin where they are seen; pairs are ordered as by brute force."""

import pytest

from identification.gap.fit.gauss_newton import fit, linearise
from identification.gap.fit.recalibration import recalibrate
from identification.gap.fit.variable_projection import ChangedRuns
from identification.gap.search.screening import (
    Start,
    _predicted,
    screen_causes,
    simulate_signatures,
    with_cause,
)
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
    (found,) = fit(problem, [start.estimate])
    assert problem.values(found)["limit"] == pytest.approx(0.8, abs=0.02)
    assert problem.values(stuck)["limit"] > 1.0
    assert found.chi_square < 0.5 * stuck.chi_square


def test_the_most_promising_cause_comes_first_and_each_cause_once():
    found = screened()
    assert [start.chi_square for start in found] == sorted(start.chi_square for start in found)
    names = [start.cause.name for start in found]
    assert len(names) == len(set(names)) == 6
