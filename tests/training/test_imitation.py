"""Behaviour cloning: the model decides as its teacher does; its critic knows the returns."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from controllers.tuned import build, load_tunings
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from training.learners.hyperparameters import Hyperparameters
from training.learners.imitation import demonstrate, imitate
from training.learners.policy_files import greedy_policy
from training.learners.ppo import TEACHER, make_model
from training.learners.training_env import make_training_env

pytestmark = pytest.mark.training

H = Hyperparameters(num_envs=64, episode_steps=300, n_steps=8, batch_size=64)
PLANT = Plant.calibrated()


def built(kind):
    return build(kind, load_tunings()[kind].values, PLANT)


def environment(seed=0):
    return make_training_env(
        H, plant=PLANT, scenario="mixed", parameters="ten_percent", weights=RewardWeights(), seed=seed
    )


def test_the_returns_are_the_discounted_sums_of_what_follows():
    env = environment()
    observations, actions, returns = demonstrate(built(TEACHER), env, steps=40, gamma=0.9, seed=0)
    assert observations.shape[:2] == actions.shape == returns.shape == (40, 64)
    rewards = returns[:-1] - np.float32(0.9) * returns[1:]
    assert np.all(rewards <= 1e-5)  # every term of the reward is zero at best
    longer = demonstrate(built(TEACHER), environment(), steps=41, gamma=0.9, seed=0)[2]
    assert longer[0] == pytest.approx(returns[0] + 0.9**40 * longer[40], rel=1e-4)


@pytest.mark.parametrize(
    ("kind", "epochs", "least"),
    [
        ("hysteresis, extrapolating", 36, 0.97),
        (TEACHER, 12, 0.93),  # it remembers past pulses, which an observation does not hold
    ],
)
def test_the_model_decides_as_its_teacher_does_on_episodes_that_it_has_not_seen(kind, epochs, least):
    example = built(kind)
    env = environment()
    model = make_model(H, env, seed=0, device="cpu")
    unseen = demonstrate(example, environment(seed=9), steps=299, gamma=H.gamma, seed=1)

    def agreement() -> float:
        observations, actions, _ = unseen
        flat = observations.reshape(-1, observations.shape[-1])
        return float(np.mean(greedy_policy(model).act(flat) == actions.ravel()))

    assert agreement() < 0.9
    losses = imitate(model, example, env, steps=299, epochs=epochs, seed=0)
    assert losses[-1] < 0.5 * losses[0]
    assert agreement() > least
