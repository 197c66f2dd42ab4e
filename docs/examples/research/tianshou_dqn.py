# pyright: reportMissingImports=false
"""Tianshou: DQN on four valves. Tianshou 2.0 needs pandas below 3, so it gets an environment of its own.

python3 -m venv tianshou && tianshou/bin/pip install . tianshou
tianshou/bin/python -m docs.examples.research.tianshou_dqn --timesteps 20000
"""

import argparse
import sys

import gymnasium
from tianshou.algorithm.modelfree.dqn import DQN, DiscreteQLearningPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv
from tianshou.utils.net.common import Net
from tianshou.utils.torch_utils import policy_within_training_step

import epv_env  # noqa: F401 - registers the ids

ENVS = 4


def make_env() -> gymnasium.Env:
    """One valve, episodes of 2 s."""
    return gymnasium.make("EPValve-v0", max_episode_steps=400)


def train(timesteps: int, seed: int = 0) -> list[float]:
    """Train; mean return of the episodes of each round of collecting [-]."""
    envs = DummyVectorEnv([make_env for _ in range(ENVS)])
    envs.seed(seed)
    space, actions = make_env().observation_space, make_env().action_space
    net = Net(state_shape=space.shape, action_shape=actions.n, hidden_sizes=(64, 64))
    policy = DiscreteQLearningPolicy(model=net, action_space=actions, eps_training=0.02)
    algorithm = DQN(
        policy=policy, optim=AdamOptimizerFactory(lr=1e-3), gamma=0.99, target_update_freq=200
    )  # fmt: skip
    buffer = VectorReplayBuffer(20_000, ENVS)
    collector = Collector(policy, envs, buffer, exploration_noise=True)
    collector.reset()
    returns = []
    for _ in range(max(timesteps // (ENVS * 400), 1)):
        collected = collector.collect(n_episode=ENVS)
        returns.append(float(collected.returns.mean()))
        with policy_within_training_step(policy):
            for _ in range(50):
                algorithm.update(buffer=buffer, sample_size=128)
    return returns


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Train with Tianshou.")
    parser.add_argument("--timesteps", type=int, default=20_000, help="environment steps")
    found = train(parser.parse_args().timesteps)
    print(f"mean return: {found[0]:.0f} at first, {found[-1]:.0f} at last")
    sys.exit()
