"""TorchRL: the environment with its true state for a critic, a collector, and PPO's loss.

python -m docs.examples.research.torchrl_ppo --timesteps 20000
"""

import argparse
import sys

import gymnasium
import torch
from tensordict.nn import TensorDictModule
from torch.distributions import Categorical
from torchrl.collectors import Collector
from torchrl.envs import GymWrapper, TransformedEnv
from torchrl.envs.transforms import Compose, DoubleToFloat, InitTracker, RewardScaling, StepCounter
from torchrl.modules import ProbabilisticActor, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

import epv_env  # noqa: F401 - registers the ids


def make_env() -> TransformedEnv:
    """One valve whose tensor dictionaries hold "true_state" and "parameters", too."""
    plain = gymnasium.make("EPValve-v0", privileged=True)
    env = GymWrapper(plain, categorical_action_encoding=True).auto_register_info_dict()
    steps = (DoubleToFloat(), RewardScaling(0.0, 0.02), StepCounter(), InitTracker())
    return TransformedEnv(env, Compose(*steps))


def network(outputs: int) -> torch.nn.Sequential:
    """A perceptron of two hidden layers."""
    return torch.nn.Sequential(
        torch.nn.LazyLinear(64), torch.nn.Tanh(), torch.nn.Linear(64, 64), torch.nn.Tanh(),
        torch.nn.Linear(64, outputs),
    )  # fmt: skip


def train(timesteps: int, seed: int = 0, frames: int = 1000) -> list[float]:
    """Train; mean reward of a step in each batch of frames [-]."""
    torch.manual_seed(seed)
    env = make_env()
    env.set_seed(seed)
    actor = ProbabilisticActor(
        TensorDictModule(network(2), in_keys=["observation"], out_keys=["logits"]),
        in_keys=["logits"], distribution_class=Categorical, return_log_prob=True,
    )  # fmt: skip
    critic = ValueOperator(network(1), in_keys=["observation"])
    first = env.reset()
    actor(first), critic(first)  # the lazy layers take their shapes
    loss, gae = ClipPPOLoss(actor, critic), GAE(gamma=0.99, lmbda=0.95, value_network=critic)
    optimiser = torch.optim.Adam(loss.parameters(), lr=1e-3)
    collector = Collector(env, actor, frames_per_batch=frames, total_frames=timesteps)
    means = []
    for batch in collector:
        gae(batch)
        for _ in range(4):
            for part in batch[torch.randperm(len(batch))].split(250):
                parts = loss(part)
                total = parts["loss_objective"] + parts["loss_critic"] + parts["loss_entropy"]
                optimiser.zero_grad()
                total.backward()
                optimiser.step()
        means.append(float(batch["next", "reward"].mean() / 0.02))
    collector.shutdown()
    return means


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Train with TorchRL.")
    parser.add_argument("--timesteps", type=int, default=20_000, help="environment steps")
    found = train(parser.parse_args().timesteps)
    print(f"mean reward of a step: {found[0]:.2f} at first, {found[-1]:.2f} at last")
    sys.exit()
