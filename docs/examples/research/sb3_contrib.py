"""sb3-contrib on the compiled batch: a recurrent PPO, and QR-DQN for the two actions.

python -m docs.examples.research.sb3_contrib --timesteps 20000
"""

import argparse
import sys

from sb3_contrib import QRDQN, RecurrentPPO
from stable_baselines3.common.evaluation import evaluate_policy

from epv_env.sb3 import make_sb3_env


def train(timesteps: int, seed: int = 0) -> dict[str, float]:
    """Train both; mean return of 8 episodes of 2 s, by algorithm [-]."""
    returns = {}
    for algorithm, policy in ((RecurrentPPO, "MlpLstmPolicy"), (QRDQN, "MlpPolicy")):
        env = make_sb3_env("EPValve-v0", num_envs=8, max_episode_steps=400)
        model = algorithm(policy, env, seed=seed, device="cpu").learn(timesteps)
        mean, _ = evaluate_policy(model, env, n_eval_episodes=8, warn=False)
        returns[algorithm.__name__] = float(mean)
    return returns


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Train with sb3-contrib.")
    parser.add_argument("--timesteps", type=int, default=20_000, help="environment steps of each")
    print(train(parser.parse_args().timesteps))
    sys.exit()
