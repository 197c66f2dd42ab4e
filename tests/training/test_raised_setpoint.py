"""A raised policy is the same policy that is shown a lower p2, and the best height is chosen."""

import numpy as np
import pytest

pytest.importorskip("torch")
import torch

from controllers.learned import LearnedPolicy
from epv_env.observation import INDEX, LAYOUT, observation_space
from training.evaluation.rollout import run_episodes
from training.learners import raised_setpoint
from training.learners.raised_setpoint import best_raised, raised
from training.learners.student import Student, policy_of
from training.learners.validation import ValidationSettings

pytestmark = pytest.mark.training
ROW = INDEX["p2_error"]


@pytest.fixture
def policy() -> LearnedPolicy:
    torch.manual_seed(1)
    return policy_of(Student(memory=8, width=16))


def test_a_raised_policy_sees_p2_lower(policy):
    space = observation_space()
    space.seed(2)
    seen = np.clip([[space.sample() for _ in range(5)] for _ in range(20)], -1, 1)
    lower = seen.copy()
    lower[..., ROW] -= 0.04 / LAYOUT[ROW].scale
    higher = raised(policy, 0.04)
    for one in (policy, higher):
        one.reset(5)
    for now, shown in zip(seen, lower, strict=True):
        np.testing.assert_allclose(higher.logits(now), policy.logits(shown), atol=1e-5)
    assert raised(policy, 0.0).layers[0][1] == pytest.approx(policy.layers[0][1])


def test_the_height_with_the_best_score_is_chosen(policy, monkeypatch):
    settings = ValidationSettings(episodes=2, duration=0.2)
    kept = best_raised(policy, (0.0,), settings, {})
    assert kept is policy  # nothing to choose from: no episode is run
    scores = iter([1.0, 5.0, 3.0])
    monkeypatch.setattr(raised_setpoint, "score", lambda metrics, price: next(scores))
    chosen = best_raised(policy, (0.0, 0.02, 0.04), settings, {"scenario": "mixed"})
    assert chosen.layers[0][1] == pytest.approx(raised(policy, 0.02).layers[0][1])


def test_a_raised_policy_holds_p2_higher():
    """A controller that opens below the target, as two layers: raised by 0.2 bar it opens earlier."""
    weight = np.zeros((2, len(LAYOUT)))
    weight[1, ROW] = 50.0
    plain = LearnedPolicy(layers=[(weight, np.zeros(2))])
    options = {"scenario": "steps", "drop_bar": 0.1}
    lowest = [
        run_episodes(one, seeds=list(range(8)), duration=2.0, options=options)[0].breakdown_bar.mean()
        for one in (plain, raised(plain, 0.2))
    ]
    assert lowest[1] < lowest[0] - 0.1
