"""Interquartile means, intervals and paired comparisons against closed forms and known truths."""

import numpy as np
import pytest

pytest.importorskip("pandas")

from training.evaluation.statistics import (
    BootstrapSettings,
    bootstrap_estimate,
    interquartile_mean,
    mean,
    mean_interval,
    paired_difference,
    pareto_front,
    probability_of_improvement,
)

pytestmark = pytest.mark.training


def test_the_interquartile_mean_is_the_mean_of_the_middle_half():
    scores = np.array([[[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]]])
    assert interquartile_mean(scores)[0] == pytest.approx(np.mean([3, 4, 5, 6]))


def test_an_outlier_moves_the_mean_and_not_the_interquartile_mean():
    scores = np.arange(8.0).reshape(1, 2, 4)
    wild = scores.copy()
    wild[0, 1, 3] = 1e6
    assert interquartile_mean(wild)[0] == interquartile_mean(scores)[0]
    assert mean(wild)[0] > 1e5


def test_95_percent_intervals_of_a_normal_mean_hold_it_about_as_often():
    rng = np.random.default_rng(1)
    held = 0
    for trial in range(200):
        scores = rng.standard_normal((1, 4, 30))
        found = bootstrap_estimate(scores, mean, settings=BootstrapSettings(resamples=200), seed=trial)
        held += found.low <= 0.0 <= found.high
    assert 0.90 <= held / 200 <= 0.985


def test_the_interval_has_the_width_of_the_normal_theory():
    scores = np.random.default_rng(0).standard_normal((1, 3, 400))
    found = bootstrap_estimate(scores, mean)
    assert found.high - found.low == pytest.approx(2 * 1.96 / np.sqrt(3 * 400), rel=0.1)


def test_strata_are_kept_so_that_differences_between_scenarios_widen_no_interval():
    offsets = np.array([0.0, 100.0, -50.0])[None, :, None]
    noise = np.random.default_rng(0).standard_normal((1, 3, 50))
    near, far = bootstrap_estimate(noise, mean), bootstrap_estimate(noise + offsets, mean)
    assert far.high - far.low == pytest.approx(near.high - near.low)


def test_training_seeds_that_differ_widen_the_interval():
    noise = np.random.default_rng(0).standard_normal((10, 3, 50))
    alike = bootstrap_estimate(noise, mean)
    apart = bootstrap_estimate(noise + np.linspace(-3, 3, 10)[:, None, None], mean)
    assert apart.high - apart.low > 3 * (alike.high - alike.low)


def test_pairing_takes_away_what_both_met():
    rng = np.random.default_rng(0)
    met = 10 * rng.standard_normal((1, 5, 40))
    ours, theirs = met + 0.1 * rng.standard_normal(met.shape), met + 1.0
    found = paired_difference(ours, theirs)
    assert found.low < -1.0 < found.high or found.value == pytest.approx(-1.0, abs=0.05)
    assert found.high - found.low < 0.1


def test_a_difference_of_nothing_is_exactly_zero():
    scores = np.random.default_rng(0).standard_normal((1, 2, 8))
    found = paired_difference(scores, scores)
    assert (found.value, found.low, found.high) == (0.0, 0.0, 0.0)


def test_the_probability_of_improvement_counts_wins_and_half_of_the_ties():
    ours = np.array([[[1.0, 2.0, 3.0, 4.0]]])
    theirs = np.array([[[2.0, 2.0, 2.0, 2.0]]])
    assert probability_of_improvement(ours, theirs, lower_is_better=True).value == 1.5 / 4
    assert probability_of_improvement(ours, theirs, lower_is_better=False).value == 2.5 / 4


def test_every_seed_meets_the_one_classic_controller():
    ours = np.stack([np.zeros((2, 3)), np.full((2, 3), 2.0)])
    theirs = np.ones((1, 2, 3))
    assert probability_of_improvement(ours, theirs, lower_is_better=True).value == 0.5


def test_the_first_episodes_pair_where_one_has_fewer():
    ours, theirs = np.zeros((1, 2, 10)), np.ones((1, 2, 3))
    assert paired_difference(ours, theirs).value == -1.0


def test_scores_of_other_scenarios_are_refused():
    with pytest.raises(ValueError, match="cannot be paired"):
        paired_difference(np.zeros((1, 2, 3)), np.zeros((1, 3, 3)))


def test_the_same_seed_gives_the_same_interval():
    scores = np.random.default_rng(0).standard_normal((3, 2, 8))
    assert bootstrap_estimate(scores) == bootstrap_estimate(scores)
    assert bootstrap_estimate(scores) != bootstrap_estimate(scores, seed=1)


def test_the_interval_of_equal_values_is_a_point():
    assert mean_interval(np.full(5, 2.0)) == (2.0, 2.0)


def test_the_front_holds_what_nothing_dominates():
    points = [(1.0, 3.0), (2.0, 2.0), (3.0, 1.0), (2.0, 3.0), (2.0, 2.0)]
    assert pareto_front(points) == [True, True, True, False, True]
