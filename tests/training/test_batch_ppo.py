"""The batch learner is stable-baselines3's PPO: same rollouts, same gradient step, same archive."""

import io
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
import torch
from stable_baselines3 import PPO

from epv_env.observation import LAYOUT
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from training.learners.batch_ppo import BatchPPO
from training.learners.hyperparameters import Hyperparameters
from training.learners.ppo import FUSED_ADAM, make_model
from training.learners.training_env import make_training_env

pytestmark = pytest.mark.training

H = Hyperparameters(num_envs=6, n_steps=20, batch_size=120, episode_steps=8, width=16, ent_coef=0.01)
"""One batch holds a whole rollout, so its order does not matter; episodes end within it."""

ARRAYS = ("observations", "actions", "rewards", "episode_starts", "values", "log_probs", "advantages")


def training_env():
    return make_training_env(
        H, plant=Plant.calibrated(), scenario="mixed", parameters="confidence", seed=0,
        weights=RewardWeights(),
    )  # fmt: skip


def learners() -> tuple[BatchPPO, PPO]:
    """This project's and stable-baselines3's, alike."""
    own = make_model(H, training_env(), seed=0, device="cpu")
    plain = PPO(
        "MlpPolicy", training_env(), n_steps=H.n_steps, batch_size=H.batch_size, n_epochs=1,
        learning_rate=own.lr_schedule, gamma=own.gamma, gae_lambda=own.gae_lambda,
        ent_coef=H.ent_coef, policy_kwargs={"net_arch": [16, 16]}, device="cpu",
    )  # fmt: skip
    plain.policy.load_state_dict(own.policy.state_dict())
    assert isinstance(own, BatchPPO)
    return own, plain


def collect(learner: PPO) -> dict[str, np.ndarray]:
    """The arrays of a first rollout."""
    _, callback = learner._setup_learn(H.num_envs * H.n_steps)
    assert learner.env is not None
    assert learner.collect_rollouts(learner.env, callback, learner.rollout_buffer, H.n_steps)
    return {name: getattr(learner.rollout_buffer, name).copy() for name in ARRAYS}


def test_a_rollout_is_that_of_stable_baselines3():
    """Where the policy is certain of its actions, though not of the same one everywhere."""
    own, plain = learners()
    for learner in (own, plain):
        certain = learner.policy.get_parameter("action_net.weight")
        certain.data *= 1e5
    ours, theirs = collect(own), collect(plain)
    assert 0.0 < ours["actions"].mean() < 1.0
    assert ours["episode_starts"][1:].any()
    for name in ARRAYS:
        np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-4, atol=1e-4, err_msg=name)
    returns = [[e["r"] for e in learner.ep_info_buffer or []] for learner in (own, plain)]
    assert len(returns[0]) == 2 * H.num_envs
    assert returns[0] == pytest.approx(returns[1])


def test_a_gradient_step_is_that_of_stable_baselines3():
    own, plain = learners()
    before = [parameter.detach().clone() for parameter in own.policy.parameters()]
    collect(own)
    plain._setup_learn(H.num_envs * H.n_steps)
    plain.rollout_buffer = own.rollout_buffer
    own.train()
    plain.train()  # last: it reorders the buffer
    for ours, theirs, old in zip(
        own.policy.parameters(), plain.policy.parameters(), before, strict=True
    ):
        assert not torch.equal(ours, old)
        torch.testing.assert_close(ours, theirs, rtol=1e-4, atol=1e-6)


def test_actions_are_drawn_with_the_policys_probabilities():
    own, _ = learners()
    one = np.random.default_rng(0).normal(size=(1, len(LAYOUT))).astype(np.float32)
    seen = np.repeat(one, 40_000, axis=0)
    torch.manual_seed(0)
    share = float(own._sampled(seen, torch.rand(len(seen), 1)).mean())
    with torch.no_grad():
        distribution: Any = own.policy.get_distribution(torch.from_numpy(one)).distribution
    wanted = float(distribution.probs[0, 1])
    assert share == pytest.approx(wanted, abs=4 * 0.5 / np.sqrt(len(seen)))


def test_stable_baselines3_reads_what_it_saves():
    own, _ = learners()
    own.learn(H.num_envs * H.n_steps)
    stream = io.BytesIO()
    own.save(stream)
    stream.seek(0)
    loaded = PPO.load(stream)
    seen = np.zeros((3, len(LAYOUT)), dtype=np.float32)
    assert np.array_equal(
        loaded.predict(seen, deterministic=True)[0], own.predict(seen, deterministic=True)[0]
    )
    for ours, theirs in zip(own.policy.parameters(), loaded.policy.parameters(), strict=True):
        assert torch.equal(ours, theirs)
    assert loaded.policy.optimizer.defaults["fused"] == FUSED_ADAM["fused"]
