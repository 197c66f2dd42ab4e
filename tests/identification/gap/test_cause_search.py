"""The search: sets of up to four causes are found, thresholds among them, and no more than acted."""

import numpy as np
import pytest

from epv_env.common.files import Journal
from identification.gap.diagnosis import rank_hypotheses
from identification.gap.fit.evidence import evaluate
from identification.gap.fit.fitting_problem import FitCache, Hypothesis
from identification.gap.fit.gauss_newton import fit
from identification.gap.fit.recalibration import recalibrate
from identification.gap.judge.verdict import Ranking
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.search.cause_search import HypothesisPool, _leave_causes_out
from tests.identification.gap.drives import Drive

THREE = {"dead_zone": 0.15, "lag": 0.03, "coupling": 0.1}
THRESHOLDS = {"dead_zone": 0.15, "limit": 0.6, "coupling": 0.1, "drift": -0.05}
FAINT_AMONG_FOUR = {**THREE, "drift": -0.05}
"""Each cause leaves so much beside the others that the second one alone hardly pays."""


def sizes(found: Ranking) -> dict[str, float]:
    """Sizes of the causes of the most probable hypothesis."""
    best = found.hypotheses[0]
    return {name: found.problem.values(best.estimate)[name] for name in best.labels}


@pytest.mark.parametrize(
    "truth", [{"limit": 0.8}, {"dead_zone": 0.3, "drag": -0.2}, THRESHOLDS, FAINT_AMONG_FOUR]
)
def test_all_that_acts_is_found_and_nothing_else(truth):
    found = rank_hypotheses(Drive(truth))
    assert sizes(found) == pytest.approx(truth, rel=0.1)
    assert all((found.inclusion[name] > 0.9) == (name in truth) for name in found.inclusion)


def test_a_cause_that_has_become_superfluous_is_left_out():
    """A pool that lacks the true cause alone: it is refitted from where a larger set has it."""
    problem, base = recalibrate(Drive({"lag": 0.05}))
    causes = {cause.name: cause for cause in problem.plant.causes}
    recalibrated = evaluate(problem, [base])[0]
    pool = HypothesisPool(problem, recalibrated, FitCache(problem.plant))
    both = Hypothesis(causes=(causes["lag"], causes["drag"]))
    pool.add(fit(problem, [problem.start(both, {"lag": 0.03, "drag": 0.1})]))
    assert pool.posterior().hypotheses[0].labels == ("lag", "drag")
    _leave_causes_out(pool)
    assert pool.posterior().hypotheses[0].labels == ("lag",)


def test_a_search_that_is_resumed_gives_the_undisturbed_answer(tmp_path):
    """With fits that were given up, and nuisance slopes that a journal does not keep."""
    plant = prepared(Drive(THRESHOLDS))
    cache = FitCache(plant, Journal(tmp_path / "fits.jsonl", {}))
    whole, resumed = rank_hypotheses(plant, cache), rank_hypotheses(plant, cache)
    assert resumed.inclusion == whole.inclusion
    np.testing.assert_array_equal(resumed.probabilities, whole.probabilities)
    for first, again in zip(whole.hypotheses, resumed.hypotheses, strict=True):
        assert first.labels == again.labels
        np.testing.assert_array_equal(first.estimate.vector, again.estimate.vector)
        np.testing.assert_array_equal(first.covariance, again.covariance)


def test_a_catalogue_without_the_true_causes_names_none():
    found = rank_hypotheses(Drive(FAINT_AMONG_FOUR, names=("limit", "drag")))
    assert found.unknown > found.no_cause + sum(found.probabilities)
    assert max(found.inclusion.values()) < 0.2


@pytest.mark.parametrize("truth", [{"limit": 0.8}, FAINT_AMONG_FOUR])
def test_no_fit_of_the_true_causes_from_their_true_sizes_is_better(truth):
    """On held-out readings, as somebody would fit them who knows what acted."""
    found = rank_hypotheses(Drive(truth))
    problem = found.problem
    causes = tuple(cause for cause in problem.plant.causes if cause.name in truth)
    direct = fit(problem, [problem.start(Hypothesis(causes=causes), truth)])
    by_hand = evaluate(problem, direct)[0].residuals[2]
    assert np.std(found.hypotheses[0].residuals[2]) < 1.05 * np.std(by_hand)
