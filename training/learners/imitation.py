"""A start for reinforcement learning: the model first imitates a controller that does the job.

From random weights the first third of a training goes into reaching the band at all, since an excess
of pressure cannot be undone, and chance decides which way of control is found. Behaviour cloning
(Pomerleau, "ALVINN: an autonomous land vehicle in a neural network", NIPS 1988) takes seconds. The
critic learns the teacher's returns along with it, so that its errors do not spoil the actor afterwards.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv

from controllers.base import Controller, Privileged
from epv_env.observation import LAYOUT

SLIPS = 0.02
"""Share of the actions that are executed wrongly, so that the learner sees how to recover."""

BATCH_SIZE = 2048


def demonstrate(
    teacher: Controller, env: VecEnv, *, steps: int, gamma: float, seed: int
) -> tuple[NDArray, NDArray, NDArray]:
    """The teacher's decisions from the start of an episode in every sub-environment.

    Returns observations (steps, n, entries), the teacher's actions (steps, n) and the discounted sums of
    the rewards that follow (steps, n). `steps` must be less than an episode has. The teacher sees the
    entries of epv_env.observation, whatever else the environment shows.
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
        slips = rng.random(env.num_envs) < SLIPS
        observation, reward, _, _ = env.step(np.where(slips, 1 - action, action))
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
) -> list[float]:
    """Fit actor and critic to a demonstration; returns the actor's mean cross-entropy in each epoch.

    learn_actor: False if the actor is the teacher already.
    """
    observations, actions, returns = demonstrate(teacher, env, steps=steps, gamma=model.gamma, seed=seed)
    known = max(steps // 2, 1)
    """The returns of later steps miss too much of what comes after the demonstration."""
    x, y = (torch.as_tensor(part.reshape(-1, *part.shape[2:])) for part in (observations, actions))
    value = torch.as_tensor(returns.reshape(-1))
    trusted = torch.arange(steps).repeat_interleave(env.num_envs) < known
    order = torch.Generator().manual_seed(seed)
    optimiser = torch.optim.Adam(model.policy.parameters(), lr=1e-3)
    losses = []
    for _ in range(epochs):
        total = 0.0
        for rows in torch.randperm(len(x), generator=order).split(BATCH_SIZE):
            values, log_probability, _ = model.policy.evaluate_actions(x[rows], y[rows])
            clone = -log_probability.mean()
            error = (values.flatten() - value[rows]) * trusted[rows]
            optimiser.zero_grad()
            (learn_actor * clone + (error**2).mean()).backward()
            optimiser.step()
            total += float(clone.detach()) * len(rows)
        losses.append(total / len(x))
    return losses
