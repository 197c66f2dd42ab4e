"""The algorithms of stable-baselines3 and sb3-contrib that the benchmark trains, and their settings.

Names are those of RL Zoo. What a record does not say is the library's default. Both environments have
the same settings, and so has every training seed.
"""

import importlib
from dataclasses import dataclass, field
from typing import Any

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv

NUM_ENVS = 16
"""Valves that a training runs side by side."""
NETWORK: dict[str, Any] = {"net_arch": [64, 64]}
"""Units of the hidden layers of every network: PPO's default. Others' are larger and slower."""

DISCRETE, CONTINUOUS = "EPValve-v0", "EPValvePWM-v0"

OFF_POLICY: dict[str, Any] = {"train_freq": 1, "gradient_steps": 1, "policy_kwargs": NETWORK}
"""An update for each period of the batch, which is 16 steps: more would cost most of the time. A single
environment has one for each step by default, or for every four (DQN, QR-DQN)."""


@dataclass(frozen=True, kw_only=True)
class Algorithm:
    """One algorithm."""

    name: str
    """What `--algo` calls it."""
    label: str
    """Name in tables and figures."""
    module: str
    """Package that it comes from."""
    type_name: str
    """Its class in that package."""
    environments: tuple[str, ...]
    """Environments whose actions it can give."""
    microseconds: int
    """Processor time of an environment step with its learning [us]: to estimate the time left."""
    policy: str = "MlpPolicy"
    hyperparameters: dict[str, Any] = field(default_factory=dict)
    """What differs from the library's defaults."""


_BOTH = (DISCRETE, CONTINUOUS)
_ROLLOUT = 2048 // NUM_ENVS  # as many transitions as one environment gives by default

ALGORITHMS = {
    algorithm.name: algorithm
    for algorithm in (
        Algorithm(
            name="ppo", label="PPO", module="stable_baselines3", type_name="PPO", environments=_BOTH,
            microseconds=110, hyperparameters={"n_steps": _ROLLOUT, "batch_size": 256},
        ),
        Algorithm(
            name="a2c", label="A2C", module="stable_baselines3", type_name="A2C", environments=_BOTH,
            microseconds=75,
        ),
        Algorithm(
            name="trpo", label="TRPO", module="sb3_contrib", type_name="TRPO", environments=_BOTH,
            microseconds=170, hyperparameters={"n_steps": _ROLLOUT},
        ),
        Algorithm(
            name="ppo_lstm", label="Recurrent PPO", module="sb3_contrib", type_name="RecurrentPPO",
            environments=_BOTH, microseconds=620, policy="MlpLstmPolicy",
            hyperparameters={
                "n_steps": _ROLLOUT, "batch_size": 1024, "policy_kwargs": {"lstm_hidden_size": 64},
            },
        ),
        Algorithm(
            name="dqn", label="DQN", module="stable_baselines3", type_name="DQN",
            environments=(DISCRETE,), microseconds=90,
            hyperparameters=OFF_POLICY,
        ),
        Algorithm(
            name="qrdqn", label="QR-DQN", module="sb3_contrib", type_name="QRDQN",
            environments=(DISCRETE,), microseconds=150,
            hyperparameters={**OFF_POLICY, "policy_kwargs": {**NETWORK, "n_quantiles": 50}},
        ),
        Algorithm(
            name="ddpg", label="DDPG", module="stable_baselines3", type_name="DDPG",
            environments=(CONTINUOUS,), microseconds=210, hyperparameters=OFF_POLICY,
        ),
        Algorithm(
            name="td3", label="TD3", module="stable_baselines3", type_name="TD3",
            environments=(CONTINUOUS,), microseconds=220, hyperparameters=OFF_POLICY,
        ),
        Algorithm(
            name="sac", label="SAC", module="stable_baselines3", type_name="SAC",
            environments=(CONTINUOUS,), microseconds=340, hyperparameters=OFF_POLICY,
        ),
        Algorithm(
            name="tqc", label="TQC", module="sb3_contrib", type_name="TQC",
            environments=(CONTINUOUS,), microseconds=400,
            hyperparameters={
                **OFF_POLICY, "top_quantiles_to_drop_per_net": 1,
                "policy_kwargs": {**NETWORK, "n_quantiles": 10},
            },
        ),
    )
}  # fmt: skip
"""By name, in the order of tables."""


def make_library_model(algorithm: Algorithm, env: VecEnv, *, seed: int) -> BaseAlgorithm:
    """An untrained model of the algorithm. Raises ModuleNotFoundError if its package is missing."""
    kind = getattr(importlib.import_module(algorithm.module), algorithm.type_name)
    settings = {**algorithm.hyperparameters}
    if "policy_kwargs" in settings:
        settings["policy_kwargs"] = dict(settings["policy_kwargs"])  # models add their own to it
    return kind(algorithm.policy, env, seed=seed, device="cpu", **settings)


def described(algorithm: Algorithm) -> dict[str, Any]:
    """What a training with the algorithm has beside the library's defaults, ready for JSON."""
    return {
        "num_envs": NUM_ENVS, "policy": algorithm.policy,
        **algorithm.hyperparameters,
    }  # fmt: skip
