"""Controllers as data: what is written is what is read, and what does not fit is refused."""

import json

import numpy as np
import pytest

from controllers.registry import kind_of, registration
from controllers.tuned import ControllersFileError, Tuning, build, load_tunings, save_tunings
from epv_env.plant.plantfile import Plant

pytest.importorskip("optuna")

pytestmark = pytest.mark.training


def test_tunings_survive_a_round_trip(tmp_path):
    tunings = {"hysteresis": Tuning(values={"open_below": -0.1}, trials=3, mean_return=-1.5, episodes=4)}
    save_tunings(tunings, tmp_path / "t.json", {"seed": 0})
    assert load_tunings(tmp_path / "t.json") == tunings


@pytest.mark.parametrize("name", [name for name in load_tunings() if name != kind_of(name)])
def test_a_tuning_under_the_stricter_objective_stands_beside_its_kinds_own(name):
    tunings = load_tunings()
    assert (tunings[name].objective, tunings[kind_of(name)].objective) == ("margin", "reward")
    controller = build(name, tunings[name].values, Plant.calibrated())
    assert controller.name == name
    assert type(controller) is registration(name).controller


def test_another_version_is_refused(tmp_path):
    (tmp_path / "t.json").write_text(json.dumps({"format": "epv-controllers/0"}))
    with pytest.raises(ControllersFileError, match="tune anew"):
        load_tunings(tmp_path / "t.json")


def test_a_written_policy_acts_as_the_model_it_came_from(tmp_path):
    pytest.importorskip("stable_baselines3")
    from controllers.learned import load_policy
    from controllers.policy_contract import PolicyError
    from epv_env.reward import RewardWeights
    from training.learners.hyperparameters import Hyperparameters
    from training.learners.policy_files import greedy_policy, save_policy
    from training.learners.ppo import make_model
    from training.learners.training_env import make_training_env

    h = Hyperparameters(num_envs=4, n_steps=8, batch_size=32)
    env = make_training_env(
        h,
        plant=Plant.calibrated(),
        scenario="mixed",
        parameters="exact",
        weights=RewardWeights(),
        seed=0,
    )
    model = make_model(h, env, seed=3, device="cpu")
    save_policy(greedy_policy(model), tmp_path, control_period=5e-3, provenance={})
    policy = load_policy(tmp_path)
    observations = np.random.default_rng(0).normal(size=(500, policy.layers[0][0].shape[1])).astype("f4")
    expected, _ = model.predict(observations, deterministic=True)
    assert np.mean(policy.act(observations) == expected) > 0.995  # ties may fall either way

    content = json.loads((tmp_path / "policy.json").read_text())
    content["observation"]["entries"].reverse()
    (tmp_path / "policy.json").write_text(json.dumps(content))
    with pytest.raises(PolicyError, match="another observation layout"):
        load_policy(tmp_path)
    content["observation"]["entries"].reverse()
    (tmp_path / "policy.json").write_text(json.dumps(content))
    (tmp_path / "policy.safetensors").write_bytes(b"no weights")
    with pytest.raises(PolicyError, match="cannot read a policy"):
        load_policy(tmp_path)
