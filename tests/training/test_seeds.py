"""Every purpose has episodes of its own."""

from itertools import pairwise

import pytest

from training.evaluation import seeds


def test_the_ranges_do_not_meet():
    firsts = sorted(seed for name, seed in vars(seeds).items() if name.endswith("_SEED"))
    assert min(b - a for a, b in pairwise(firsts)) >= seeds.RANGE


def test_a_training_seed_that_would_meet_the_tuning_is_refused():
    assert seeds.training_seeds(3, 256) == range(768, 1024)
    assert seeds.training_seeds(3905, 256)[-1] < seeds.TUNING_SEED
    with pytest.raises(ValueError, match=r"training seed 3906 .* give one up to 3905"):
        seeds.training_seeds(3906, 256)


def test_episodes_beyond_their_range_are_refused():
    seeds.check_first_seed(995_904, 4096)
    with pytest.raises(ValueError, match="with 4096 episodes give one up to 995904"):
        seeds.check_first_seed(995_905, 4096)
