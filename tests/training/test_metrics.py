"""The control aims' figures of known episodes, their intervals and differences; seeds by purpose."""

from itertools import pairwise

import numpy as np
import pytest

from epv_env.result import CONSUMPTION, DEVIATION, FAILED, N_FIGURE, REWARD, SWITCHINGS, VENTED
from training.evaluation import seeds
from training.evaluation.metrics import (
    METER,
    EpisodeMetrics,
    count_all,
    summary,
    tail_excursion,
    violation_interval,
)
from training.evaluation.statistics import MANY, mean_interval, paired_difference

PERIOD = 0.1


def run(deviations, settling_time=0.0, failed=None, consumption=None):
    """The metrics of one episode with these deviations [bar]; each period: a switching, 1 mg, 2 W."""
    meters, figures = np.zeros(1, METER), np.zeros((N_FIGURE, 1))
    figures[[SWITCHINGS, VENTED, REWARD], 0] = 1.0, 1e-6, -1.0
    for k, deviation in enumerate(deviations):
        drawn = 0.0 if consumption is None else 1e-3 * consumption[k]
        figures[[DEVIATION, CONSUMPTION, FAILED], 0] = deviation, drawn, failed == k
        count_all(meters, figures, np.array([2.0 * PERIOD * (k + 1)]), PERIOD, settling_time)
    return EpisodeMetrics.of(meters, PERIOD)


def test_figures_of_a_known_episode():
    m = run([0.1, -0.3, -0.4, 0.2])
    assert m.excursion_bar[0] == pytest.approx(0.4)
    assert m.breakdown_bar[0] == pytest.approx(0.4)
    assert m.recovery_s[0] == pytest.approx(2 * PERIOD)
    assert m.rms_bar[0] == pytest.approx(np.sqrt((0.01 + 0.09 + 0.16 + 0.04) / 4))
    assert m.switchings_per_s[0] == pytest.approx(1 / PERIOD)
    assert m.vented_g_per_s[0] == pytest.approx(1e-3 / PERIOD)
    assert m.coil_W[0] == pytest.approx(2.0)
    assert m.episode_return[0] == -4.0
    assert m.stayed[0]


@pytest.mark.parametrize(
    ("deviations", "options", "stayed"),
    [
        ([-3.0, 0.1], {"settling_time": PERIOD}, True),
        ([0.1, -3.0], {"settling_time": PERIOD}, False),
        ([0.6], {}, False),
        ([0.0, 0.0], {"failed": 1}, False),
    ],
)
def test_who_leaves_after_settling_or_fails_has_not_stayed(deviations, options, stayed):
    found = run(deviations, **options)
    assert found.stayed[0] == stayed
    assert (found.breakdown_bar[0] > 0) == (not stayed and deviations[-1] < 0)  # an overshoot is none


def test_an_episode_ends_with_the_period_of_its_failure():
    ended, shorter = run([-0.1, -0.3, -9.0, -9.0], failed=1), run([-0.1, -0.3])
    for name in ("episode_return", "rms_bar", "switchings_per_s", "vented_g_per_s", "breakdown_bar"):
        assert getattr(ended, name) == getattr(shorter, name), name
    assert ended.episode_return[0] == -2.0


DRAWN = 2.0  # g/s, well above the threshold of an event


def test_an_events_breakdown_is_its_own():
    drawn = [0.0, DRAWN, DRAWN, 0.0, 0.0, DRAWN, 0.0]
    m = run([-0.9, -0.1, -0.2, -0.4, -0.1, -0.3, 0.1], consumption=drawn)
    assert m.events[0] == 2
    assert m.event_breakdown_bar[0] == pytest.approx((0.4 + 0.3) / 2)  # what came before is nobody's
    assert m.breakdown_bar[0] == pytest.approx(0.9)


def test_recovery_lasts_from_the_events_beginning_until_p2_is_back_above_the_shortfall():
    drawn = [0.0, DRAWN, DRAWN, 0.0, 0.0]
    m = run([0.0, -0.1, -0.3, -0.4, -0.2], consumption=drawn)
    assert m.event_recovery_s[0] == pytest.approx(3 * PERIOD)
    assert m.longest_event_recovery_s[0] == pytest.approx(3 * PERIOD)


def test_a_shortfall_long_after_an_event_is_not_its_breakdown():
    quiet = [0.0] * 12
    m = run([-0.1, *quiet, -0.4], consumption=[DRAWN, *quiet, 0.0])
    assert m.event_breakdown_bar[0] == pytest.approx(0.1)


def test_a_leak_is_no_event():
    assert run([-0.1] * 4, consumption=[0.0, 0.8, 0.8, 0.8]).events[0] == 0


def test_the_exact_bound_needs_3688_episodes_for_a_thousandth():
    """Clopper and Pearson with no event: 1 - (alpha / 2)^(1 / n)."""
    assert violation_interval(np.ones(3687, dtype=bool))[1] > 1e-3
    assert violation_interval(np.ones(3688, dtype=bool))[1] <= 1e-3
    assert violation_interval(np.ones(10, dtype=bool)) == (0.0, pytest.approx(1 - 0.025**0.1))


def test_the_tail_excursion_is_exceeded_by_one_episode_in_a_thousand():
    excursion = np.arange(2000.0)
    assert np.sum(excursion > tail_excursion(excursion)) == 2
    assert tail_excursion(excursion[:500]) == 499.0


def test_episodes_join_and_their_events_weigh_equally():
    one = run([-0.3], consumption=[DRAWN])
    three = run([-0.1, -0.1] * 3, consumption=[DRAWN, 0.0] * 3)
    both = EpisodeMetrics.joined([one, three])
    assert len(both) == 2
    assert summary(both)["C2_event_breakdown_bar"] == pytest.approx((0.3 + 3 * 0.1) / 4)
    assert len(both.first(1)) == 1


def test_95_percent_intervals_of_a_normal_mean_hold_it_about_as_often():
    rng = np.random.default_rng(1)
    ends = [mean_interval(rng.standard_normal(60)) for _ in range(150)]
    held = np.mean([low <= 0.0 <= high for low, high in ends])
    assert 0.90 <= held <= 0.985


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


def test_the_first_episodes_pair_where_one_has_fewer():
    assert paired_difference(np.zeros(10), np.ones(3)).value == -1.0


def test_the_ranges_do_not_meet():
    firsts = sorted(seed for name, seed in vars(seeds).items() if name.endswith("_SEED"))
    assert min(b - a for a, b in pairwise(firsts)) >= seeds.RANGE


def test_a_training_stays_in_its_range_and_each_has_its_own_episodes():
    firsts = {seeds.first_training_seed(seed, steps, 1024) for seed in range(40) for steps in (0, 10**6)}
    assert len(firsts) == 80
    assert min(firsts) >= seeds.TRAINING_SEED
    assert max(firsts) + 1024 <= seeds.TRAINING_SEED + seeds.RANGE


def test_episodes_beyond_their_range_are_refused():
    seeds.check_first_seed(995_904, 4096)
    with pytest.raises(ValueError, match="with 4096 episodes give one up to 995904"):
        seeds.check_first_seed(995_905, 4096)
