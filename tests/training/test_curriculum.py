"""The price of switching rises during training and ends at the reward's own."""

import pytest

pytest.importorskip("stable_baselines3")

from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from training.ppo import Hyperparameters, RisingPrice, make_model, make_training_env

pytestmark = pytest.mark.training


def test_the_price_rises_from_the_first_to_the_full_one():
    h = Hyperparameters(
        num_envs=4, n_steps=8, batch_size=32, first_switching_price=0.1, rising_share=0.5
    )
    weights = RewardWeights(switching=0.5)
    env = make_training_env(
        h, plant=Plant.calibrated(), scenario="mixed", parameters="exact", weights=weights, seed=0
    )
    model = make_model(h, env, seed=0, device="cpu")
    rising = RisingPrice(h, weights, total=1000)
    rising.init_callback(model)
    prices = []
    for done in (0, 250, 500, 1000):
        rising.num_timesteps = done
        rising.on_rollout_start()
        prices.append(env.get_attr("settings")[0].weights.switching)
    assert prices == pytest.approx([0.1, 0.3, 0.5, 0.5])
    assert env.get_attr("task")[0].settings.weights.band == weights.band
