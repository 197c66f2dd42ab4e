"""Every purpose has episodes of its own."""

from itertools import pairwise

import pytest

from training.evaluation import seeds


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
