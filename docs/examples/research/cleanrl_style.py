"""PPO in one file, in the style of CleanRL: Gymnasium's vector environment and plain torch.

python -m docs.examples.research.cleanrl_style --timesteps 200000
"""

import argparse
import sys

import gymnasium
import numpy as np
import torch
from torch.distributions import Categorical

import epv_env  # noqa: F401 - registers the ids

ENVS, STEPS, EPOCHS, BATCHES = 64, 64, 4, 8
GAMMA, LAMBDA, CLIP, RATE, SCALE = 0.99, 0.95, 0.2, 1e-3, 0.02


def network(outputs: int) -> torch.nn.Sequential:
    """A perceptron of two hidden layers that reads an observation."""
    return torch.nn.Sequential(
        torch.nn.LazyLinear(64), torch.nn.Tanh(), torch.nn.Linear(64, 64), torch.nn.Tanh(),
        torch.nn.Linear(64, outputs),
    )  # fmt: skip


def advantages(
    rewards: torch.Tensor, values: torch.Tensor, ended: torch.Tensor, failed: torch.Tensor
) -> torch.Tensor:
    """Generalised advantage estimates (STEPS, ENVS); values: (STEPS + 1, ENVS).

    A time limit is no end of the task: the value of the last observation stands for what follows.
    """
    result, following = torch.zeros_like(rewards), torch.zeros(ENVS)
    for k in reversed(range(STEPS)):
        surprise = rewards[k] + GAMMA * values[k + 1] * ~failed[k] - values[k]
        following = surprise + GAMMA * LAMBDA * following * ~ended[k]
        result[k] = following
    return result


def train(timesteps: int, seed: int = 0) -> list[float]:
    """Train; mean reward of a step in each rollout [-]."""
    torch.manual_seed(seed)
    env = gymnasium.make_vec("EPValve-v0", num_envs=ENVS)  # autoreset in the next step
    actor, critic = network(2), network(1)
    observation = torch.from_numpy(env.reset(seed=seed)[0])
    actor(observation), critic(observation)  # the lazy layers take their shapes
    parameters = [*actor.parameters(), *critic.parameters()]
    optimiser = torch.optim.Adam(parameters, lr=RATE)
    stale = torch.zeros(ENVS, dtype=torch.bool)  # ended before: the next step only resets
    means = []
    for _ in range(max(timesteps // (ENVS * STEPS), 1)):
        rows: list[list[torch.Tensor]] = []
        for _ in range(STEPS):
            with torch.no_grad():
                choice = Categorical(logits=actor(observation))
                action = choice.sample()
                value = critic(observation)[:, 0]
            following, reward, terminated, truncated, _ = env.step(action.numpy())
            failed, ended = torch.from_numpy(terminated), torch.from_numpy(terminated | truncated)
            gain = torch.from_numpy(reward * SCALE).float()
            rows.append(
                [observation, action, choice.log_prob(action), value, gain, failed, ended, ~stale]
            )
            observation, stale = torch.from_numpy(following), ended
        seen, actions, old, values, rewards, failed, ended, counts = map(
            torch.stack, zip(*rows, strict=True)
        )
        with torch.no_grad():
            last = critic(observation)[None, :, 0]
        gains = advantages(rewards, torch.cat([values, last]), ended, failed)
        wanted = gains + values
        keep = torch.nonzero(counts.flatten())[:, 0]
        for _ in range(EPOCHS):
            for batch in keep[torch.randperm(len(keep))].chunk(BATCHES):
                x, a, g = seen.flatten(0, 1)[batch], actions.flatten()[batch], gains.flatten()[batch]
                g = (g - g.mean()) / (g.std() + 1e-8)
                log = Categorical(logits=actor(x)).log_prob(a)
                ratio = (log - old.flatten()[batch]).exp()
                policy_loss = -torch.min(g * ratio, g * ratio.clamp(1 - CLIP, 1 + CLIP)).mean()
                value_loss = (critic(x)[:, 0] - wanted.flatten()[batch]).square().mean()
                optimiser.zero_grad()
                (policy_loss + value_loss).backward()
                torch.nn.utils.clip_grad_norm_(parameters, 0.5)
                optimiser.step()
        means.append(float(np.mean(rewards.numpy()) / SCALE))
    return means


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Train with a single file of PPO.")
    parser.add_argument("--timesteps", type=int, default=200_000, help="environment steps")
    found = train(parser.parse_args().timesteps)
    print(f"mean reward of a step: {found[0]:.2f} at first, {found[-1]:.2f} at last")
    sys.exit()
