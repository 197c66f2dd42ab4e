"""PPO through the recurrent unit: the rollout is the policy's, and an interruption changes nothing."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
import torch

from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from tests.training.test_recurrent import same
from training.learners import learning_log
from training.learners.hyperparameters import Hyperparameters
from training.learners.policy_files import greedy_policy, put_student
from training.learners.ppo import make_model, train
from training.learners.sequence_ppo import SequencePPO, log_probability
from training.learners.student import Student, policy_of
from training.learners.training_env import make_training_env

pytestmark = pytest.mark.training

TASK: dict[str, Any] = {
    "plant": Plant.calibrated(), "scenario": "mixed", "parameters": "sensitive_ten_percent",
    "weights": RewardWeights(),
}  # fmt: skip
H = Hyperparameters(
    end_to_end=True, num_envs=6, n_steps=20, batch_size=60, episode_steps=20, longest_episode_steps=60,
    width=16, critic_width=16, imitation_epochs=0, validations=1, validation_episodes=4,
    validation_duration=0.8,
)  # fmt: skip


def student():
    torch.manual_seed(2)
    return policy_of(Student(memory=8, width=16))


def learner(h=H) -> SequencePPO:
    env = make_training_env(h, seed=0, privileged=True, **TASK)
    model = make_model(h, env, seed=0, device="cpu", cells=8)
    assert isinstance(model, SequencePPO)
    put_student(model, student(), 1.0)
    return model


def roll(model, rollouts=1):
    """The last of some rollouts; the model is ready to learn from it."""
    _, callback = model._setup_learn(H.num_envs * H.n_steps)
    assert model.env is not None
    for _ in range(rollouts):
        assert model.collect_rollouts(model.env, callback, model.rollout_buffer, H.n_steps)
    return model.rollout_buffer


def test_the_actor_is_the_student_s():
    assert same(greedy_policy(learner()), student())


def test_windows_give_the_probabilities_with_which_the_actions_were_drawn():
    """So the first ratio is one: also in a rollout that begins within some of the episodes."""
    model = learner()
    for rollouts in (1, 2):
        buffer = roll(model, rollouts)
        observations, actions, old, _, _, before, whole = model._windows(buffer)
        with torch.no_grad():
            found = log_probability(model.policy.log_odds(observations, before), actions)
        assert whole.all()
        torch.testing.assert_close(found, old, rtol=1e-4, atol=1e-5)
    assert 0 < before.abs().amax(dim=1).count_nonzero() < H.num_envs


def test_a_restart_erases_the_memory_between_two_rollouts():
    for restarts in (0.0, 1.0):
        model = learner(replace(H, restarts=restarts))
        roll(model, 2)
        assert model._before.any() == (restarts == 0)


def test_a_window_in_which_another_episode_begins_teaches_the_critic_only():
    model = learner()
    buffer = roll(model)
    buffer.episode_starts[7, :] = True
    actor, critic = model.policy.actor, model.policy.critic
    before = [[p.detach().clone() for p in part.parameters()] for part in (actor, critic)]
    model.train()
    assert all(torch.equal(p, q) for p, q in zip(actor.parameters(), before[0], strict=True))
    assert not all(torch.equal(p, q) for p, q in zip(critic.parameters(), before[1], strict=True))


def test_learning_makes_good_actions_more_likely():
    model = learner()
    buffer = roll(model)
    buffer.advantages[:] = np.where(buffer.actions[..., 0] > 0.5, 1.0, -1.0)
    observations, actions, old, _, _, before, _ = model._windows(buffer)
    model.train()
    with torch.no_grad():
        odds = model.policy.log_odds(observations, before)
    assert log_probability(odds, torch.ones_like(actions)).mean() > old[actions > 0.5].mean()


def test_the_critic_learns_alone_at_first():
    model = learner(Hyperparameters(**{**vars(H), "critic_first": 10_000}))
    roll(model)
    model.train()
    assert same(greedy_policy(model), student())


@pytest.mark.parametrize("rollouts", [1, 3])
def test_a_killed_training_resumes_to_the_same_policy(tmp_path, monkeypatch, rollouts):
    """To the bit: memory, average and charged episodes are in the checkpoint, too."""

    def trained(folder, resume=False):
        policy, _ = train(
            H, folder=folder, timesteps=600, seed=1, device="cpu", resume=resume, quiet=True,
            student=student(), **TASK,
        )  # fmt: skip
        return policy

    whole = trained(tmp_path / "whole")
    collected = SequencePPO.collect_rollouts
    remaining = iter(range(rollouts))

    def dying(*arguments, **named):
        if next(remaining, None) is None:
            raise SystemError("killed")
        return collected(*arguments, **named)

    monkeypatch.setattr(SequencePPO, "collect_rollouts", dying)
    monkeypatch.setattr(learning_log, "CHECKPOINT_SECONDS", 0.0)
    with pytest.raises(SystemError):
        trained(tmp_path / "parts")
    monkeypatch.undo()
    assert same(trained(tmp_path / "parts", resume=True), whole)
    assert not same(whole, student())
