"""Behaviour cloning before reinforcement learning: the model first imitates a working controller.

From random weights the first third of a training goes into reaching the band at all, since an excess
of pressure cannot be undone, and chance decides which way of control PPO finds. Behaviour cloning
(Pomerleau, "ALVINN: an autonomous land vehicle in a neural network", NIPS 1988) takes seconds. The
critic learns the teacher's returns at the same time, so that its errors do not spoil the actor later.
"""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv

from controllers.base import Controller, Privileged
from epv_env.observation import LAYOUT


@dataclass(frozen=True, kw_only=True)
class ImitationSettings:
    """How demonstrations are made and learned."""

    action_noise: float = 0.02
    """Share of the actions that are executed wrongly, so that the learner sees how to recover [1]."""
    batch_size: int = 2048
    """Decisions of a gradient step."""
    learning_rate: float = 1e-3
    """Adam's step size."""
    trusted_share: float = 0.5
    """Share of the demonstration, from its start, whose returns the critic learns [1]. The returns of
    later steps miss too much of what comes after the demonstration."""


def with_action_noise(
    actions: NDArray, rng: np.random.Generator, settings: ImitationSettings = ImitationSettings()
) -> NDArray:
    """Actions (n,), 0 or 1, of which a random share is inverted, (n,)."""
    wrong = rng.random(len(actions)) < settings.action_noise
    return np.where(wrong, 1 - actions, actions)


def demonstrate(
    teacher: Controller,
    env: VecEnv,
    *,
    steps: int,
    gamma: float,
    seed: int,
    settings: ImitationSettings = ImitationSettings(),
) -> tuple[NDArray, NDArray, NDArray]:
    """The teacher's decisions from the start of an episode in every sub-environment.

    Args:
        teacher: sees the entries of epv_env.observation, whatever else the environment shows.
        env: n sub-environments.
        steps: control periods, fewer than an episode has.
        gamma: discount factor of a control period [1].
        seed: of the action noise.
        settings: of the imitation.

    Returns:
        Observations (steps, n, entries), the teacher's actions (steps, n), and the discounted sums of
        the rewards that follow (steps, n).
    """
    rng = np.random.default_rng(seed)
    observation = env.reset()
    assert isinstance(observation, np.ndarray)
    teacher.reset(env.num_envs)
    if isinstance(teacher, Privileged):
        teacher.watch(env.get_attr("task")[0])
    observations, actions, rewards = [], [], []
    for _ in range(steps):
        action = teacher.act(observation[:, : len(LAYOUT)])
        observations.append(observation)
        actions.append(action)
        observation, reward, _, _ = env.step(with_action_noise(action, rng, settings))
        assert isinstance(observation, np.ndarray)
        rewards.append(reward)
    returns = np.array(rewards, dtype=np.float32)
    for k in reversed(range(steps - 1)):
        returns[k] += gamma * returns[k + 1]
    return np.array(observations), np.array(actions), returns


def imitate(
    model: PPO,
    teacher: Controller,
    env: VecEnv,
    *,
    steps: int,
    epochs: int,
    seed: int,
    learn_actor: bool = True,
    settings: ImitationSettings = ImitationSettings(),
) -> list[float]:
    """Fit actor and critic to a demonstration; returns the actor's mean cross-entropy in each epoch.

    Args:
        model: whose actor and critic learn.
        teacher: whose decisions they learn.
        env: n sub-environments.
        steps: control periods of the demonstration.
        epochs: passes over it.
        seed: of the action noise and of the batches.
        learn_actor: False if the actor is the teacher already.
        settings: of the imitation.
    """
    observations, actions, returns = demonstrate(
        teacher, env, steps=steps, gamma=model.gamma, seed=seed, settings=settings
    )
    x, y = (torch.as_tensor(part.reshape(-1, *part.shape[2:])) for part in (observations, actions))
    value = torch.as_tensor(returns.reshape(-1))
    trusted_steps = max(int(steps * settings.trusted_share), 1)
    trusted = torch.arange(steps).repeat_interleave(env.num_envs) < trusted_steps
    order = torch.Generator().manual_seed(seed)
    optimiser = torch.optim.Adam(model.policy.parameters(), lr=settings.learning_rate)
    losses = []
    for _ in range(epochs):
        total = 0.0
        for rows in torch.randperm(len(x), generator=order).split(settings.batch_size):
            values, log_probability, _ = model.policy.evaluate_actions(x[rows], y[rows])
            cross_entropy = -log_probability.mean()
            error = (values.flatten() - value[rows]) * trusted[rows]
            optimiser.zero_grad()
            (learn_actor * cross_entropy + (error**2).mean()).backward()
            optimiser.step()
            total += float(cross_entropy.detach()) * len(rows)
        losses.append(total / len(x))
    return losses
