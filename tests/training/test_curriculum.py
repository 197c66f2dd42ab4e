"""Exploration fades as training goes on; trainings with different seeds meet different episodes."""

import pytest

pytest.importorskip("stable_baselines3")

from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from training.learners.hyperparameters import Hyperparameters
from training.learners.ppo import make_model
from training.learners.schedules import FadingEntropy
from training.learners.training_env import make_training_env

pytestmark = pytest.mark.training


@pytest.fixture(scope="module")
def model():
    h = Hyperparameters(num_envs=4, n_steps=8, batch_size=32)
    env = make_training_env(
        h, plant=Plant.calibrated(), scenario="mixed", parameters="exact", weights=RewardWeights(),
        seed=0,
    )  # fmt: skip
    return make_model(h, env, seed=0, device="cpu")


def over_time(callback, model, read):
    """What `read` gives after 0, 250, 500 and 1000 steps."""
    callback.init_callback(model)
    values = []
    for done in (0, 250, 500, 1000):
        callback.num_timesteps = done
        callback.on_rollout_start()
        values.append(read())
    return values


def test_exploration_fades_to_nothing(model):
    bonus = over_time(FadingEntropy(0.004, total=1000), model, lambda: model.ent_coef)
    assert bonus == pytest.approx([0.004, 0.003, 0.002, 0.0])


def test_trainings_with_neighbouring_seeds_share_no_episode():
    h = Hyperparameters(num_envs=4)
    targets = []
    for seed in (0, 1):
        env = make_training_env(
            h, plant=Plant.calibrated(), scenario="mixed", parameters="exact",
            weights=RewardWeights(), seed=seed,
        )  # fmt: skip
        env.reset()
        targets += env.get_attr("task")[0].target.tolist()
    assert len(set(targets)) == 8
