"""Intervals and paired differences against closed forms and known truths."""

import numpy as np
import pytest

pytest.importorskip("pandas")

from training.evaluation.statistics import MANY, mean_interval, paired_difference

pytestmark = pytest.mark.training


def test_95_percent_intervals_of_a_normal_mean_hold_it_about_as_often():
    rng = np.random.default_rng(1)
    ends = [mean_interval(rng.standard_normal(60)) for _ in range(150)]
    held = np.mean([low <= 0.0 <= high for low, high in ends])
    assert 0.90 <= held <= 0.985


def test_the_interval_has_the_width_of_the_normal_theory():
    low, high = mean_interval(np.random.default_rng(0).standard_normal(1200))
    assert high - low == pytest.approx(2 * 1.96 / np.sqrt(1200), rel=0.1)


def test_the_interval_of_many_is_that_of_resampling(monkeypatch):
    values = np.random.default_rng(0).exponential(size=MANY + 1)
    many = mean_interval(values)
    monkeypatch.setattr("training.evaluation.statistics.MANY", len(values))
    assert many == pytest.approx(mean_interval(values), abs=0.05 * np.ptp(many))


def test_pairing_takes_away_what_both_met():
    rng = np.random.default_rng(0)
    met = 10 * rng.standard_normal(200)
    ours, theirs = met + 0.1 * rng.standard_normal(200), met + 1.0
    found = paired_difference(ours, theirs)
    assert found.value == pytest.approx(-1.0, abs=0.05)
    assert found.low < found.value < found.high
    assert found.high - found.low < 0.1


def test_a_difference_of_nothing_is_exactly_zero():
    scores = np.random.default_rng(0).standard_normal(8)
    assert paired_difference(scores, scores) == (0.0, 0.0, 0.0)


def test_the_first_episodes_pair_where_one_has_fewer():
    assert paired_difference(np.zeros(10), np.ones(3)).value == -1.0
