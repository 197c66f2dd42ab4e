"""The diagnosis on a plant that is not the valve: what is wrong is found, or nothing is."""

import numpy as np
import pytest

from docs.examples.tank.plant import Tank
from docs.examples.tank.recordings import virtual_recordings
from identification.gap.fit.fit_cache import FitCache
from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.gauss_newton import fit
from identification.gap.fit.hypothesis import Hypothesis
from identification.gap.rank.cause_pairs import (
    ResidualScale,
    limit_pair_odds,
    refit_members_of_best_pair,
)
from identification.gap.rank.evidence import EvaluatedHypothesis, evaluate
from identification.gap.rank.misfit import segments
from identification.gap.rank.ranking import rank_hypotheses
from identification.gap.rank.refinement import recalibrate
from identification.gap.rank.settings import RankingSettings

SETTINGS = RankingSettings()


@pytest.mark.parametrize(("name", "size"), [("leak", 4e-3), ("lag", 4.0), ("evaporation", 8e-4)])
def test_the_cause_that_made_the_recordings_is_found_with_its_size(name, size):
    found = rank_hypotheses(Tank(virtual_recordings({"c": 0.021, name: size})))
    best = found.hypotheses[0]
    assert best.labels == (name,)
    assert found.probabilities[0] > 0.7
    fitted = found.problem.values(best.estimate)
    assert fitted["c"] == pytest.approx(0.021, rel=0.02)
    assert fitted[name] == pytest.approx(size, abs=4 * np.sqrt(best.covariance[-1, -1]))
    held_out = np.concatenate([best.residuals[2].ravel()])
    assert np.sqrt(np.mean(held_out**2)) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("seed", range(5))
def test_without_a_cause_recalibration_is_enough(seed):
    found = rank_hypotheses(Tank(virtual_recordings({"c": 0.021}, seed=seed)))
    assert found.no_cause > 0.5
    assert found.no_cause + found.unknown + sum(found.probabilities) == pytest.approx(1.0)


def test_what_the_catalogue_lacks_is_unknown():
    """An inflow that is not what was measured: no cause of the list makes steps of its own."""
    tank = Tank(virtual_recordings({"c": 0.021}))
    for run in tank.runs:
        run.measured[:] += 0.02 * np.sin(run.time / 3.0)
    found = rank_hypotheses(tank)
    assert found.unknown > 0.9


def test_two_causes_are_found_together():
    found = rank_hypotheses(Tank(virtual_recordings({"leak": 4e-3, "lag": 5.0})))
    assert set(found.hypotheses[0].labels) == {"leak", "lag"}
    assert found.probabilities[0] > 0.9


def evaluated(
    problem: FittingProblem, **sizes: float
) -> tuple[EvaluatedHypothesis, EvaluatedHypothesis]:
    """Causes at given sizes, and fitted from there."""
    causes = tuple(cause for cause in problem.plant.causes if cause.name in sizes)
    start = problem.start(Hypothesis(causes=causes), {"c": 0.021, **sizes})
    at, fitted = evaluate(problem, [start, *fit(problem, [start])], SETTINGS)
    return at, fitted


@pytest.mark.parametrize(("lag", "likelier"), [(5.0, True), (0.0, False)])
def test_the_odds_of_a_pair_against_its_stronger_member_are_limited_by_its_gain(lag, likelier):
    problem, _ = recalibrate(Tank(virtual_recordings({"leak": 4e-3, "lag": lag})))
    (_, leak), (_, both) = evaluated(problem, leak=3e-3), evaluated(problem, leak=3e-3, lag=2.0)
    lowest = min(leak.excess, both.excess, 0.0)
    scale = ResidualScale(lowest_excess=lowest, settings=SETTINGS)
    member, pair = limit_pair_odds([leak, both], [0.0, 1000.0], scale)
    assert (pair > member) == likelier
    assert (member > 0.0) == likelier  # the pair confirms its member; else the pair is lowered
    assert (pair == 1000.0) == likelier


def test_a_cause_that_got_stuck_alone_is_fitted_again_from_where_the_best_pair_has_it():
    problem, _ = recalibrate(Tank(virtual_recordings({"leak": 4e-3})))
    (stuck, fitted), (_, pair) = evaluated(problem, leak=1e-4), evaluated(problem, leak=3e-3, lag=1.0)
    cache = FitCache(problem.plant)
    refitted = refit_members_of_best_pair(problem, [stuck], [pair], cache, SETTINGS)
    mended = {each.labels: each for each in refitted}
    assert mended[("leak",)].log_evidence == pytest.approx(fitted.log_evidence, abs=1.0)
    assert fitted.log_evidence > stuck.log_evidence + 100.0
    assert set(mended) == {("leak",), ("lag",)}


def test_the_same_recordings_give_the_same_verdict():
    one, other = (rank_hypotheses(Tank(virtual_recordings({"leak": 2e-3}))) for _ in range(2))
    assert one.probabilities == other.probabilities


def test_held_out_runs_are_not_fitted_to():
    tank = Tank(virtual_recordings({"c": 0.021}))
    problem, estimate = recalibrate(tank)
    tank.runs[2].measured[:] += 0.5
    _, again = recalibrate(tank)
    assert problem.fitted_runs == [0, 1]
    np.testing.assert_array_equal(estimate.vector, again.vector)


def test_segments_keep_every_sample():
    series = np.arange(1.0, 24.0)
    cut = segments(series, 1e-3, SETTINGS.segment_duration)
    assert cut.shape == (5, 5)
    np.testing.assert_array_equal(cut.ravel()[:23], series)
