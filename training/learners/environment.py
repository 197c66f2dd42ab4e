"""The episodes that PPO trains on: drawn plants, hard applications, a narrower band."""

from collections.abc import Callable
from dataclasses import replace

import gymnasium
from gymnasium.vector import AutoresetMode, VectorEnv
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper, VecMonitor
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

import epv_env  # noqa: F401 - registers the ids
from controllers.knowledge import LearntObservation
from epv_env.conditions import Conditions
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Mixture, Region
from epv_env.reward import RewardWeights
from epv_env.sb3 import SB3VectorEnv

NUM_ENVS = 1024
"""Episodes that run side by side."""
ROLLOUT = 64
"""Periods between two updates: a third of a second, in which a pulse and its answer lie."""
SHORTEST, LONGEST = 300, 600
"""Lengths of the training episodes [control periods]. Different lengths keep the environments out of
step: every rollout sees all parts of an episode."""
CONDITIONS = Conditions(braking=0.5, vented=0.1, target_steps=0.15, delayed=0.1)
"""Half of the training episodes brake hard, where a good policy leaves the band. The rest of what a
policy meets is rarer: a start with an empty control chamber, a target that steps, a late coil."""
REWARD_SCALE = 0.08
"""Factor of the rewards that PPO sees [1]: the critic's errors become about as large as the actor's
advantages, whose gradients PPO clips together."""
FACTORS = {"band": 2.0, "tracking": 1.2, "breakdown": 1.4, "switching": 2.0}
"""Prices of the training, relative to the reward's: with the reward's own, smaller errors and
pressure dips would be bought by more switchings, and rare violations would hardly count."""
BAND_BAR = 0.3
"""Half-width of the band that is priced in training [bar]: the policy keeps a margin."""


class ScaledReward(VecEnvWrapper):
    """Rewards times REWARD_SCALE; the monitor inside counts them as they are."""

    def reset(self) -> VecEnvObs:
        """First observations (n, all)."""
        return self.venv.reset()

    def step_wait(self) -> VecEnvStepReturn:
        """Observations (n, all), scaled rewards (n,), ends (n,) and infos."""
        observation, reward, done, infos = self.venv.step_wait()
        return observation, REWARD_SCALE * reward, done, infos


def training_weights(weights: RewardWeights) -> RewardWeights:
    """The reward's prices in training: raised by FACTORS, and a narrower band."""
    raised = {name: factor * getattr(weights, name) for name, factor in FACTORS.items()}
    return replace(weights, band_bar=min(weights.band_bar, BAND_BAR), **raised)


def with_rules(env: VectorEnv) -> VectorEnv:
    """The environment behind the rules; the learnt quantities are observed, too."""
    return LearntObservation(env, rules=True)


def make_training_env(
    *,
    plant: Plant,
    num_envs: int = NUM_ENVS,
    scenario: str = "mixed",
    parameters: str | Region | Mixture = "sensitive_ten_percent",
    weights: RewardWeights,
    wrap: Callable[[VectorEnv], VectorEnv] = with_rules,
) -> VecEnv:
    """Episodes on drawn plants.

    Args:
        plant: centre of the region.
        num_envs: episodes side by side.
        scenario: of the consumption.
        parameters: region that plants are drawn from, or its name.
        weights: prices of the reward.
        wrap: what stands between the environment and the algorithm.
    """
    lengths = range(SHORTEST, LONGEST + 1, ROLLOUT)
    env = gymnasium.make_vec(
        "EPValve-v0",
        num_envs=num_envs,
        vectorization_mode="vector_entry_point",
        autoreset_mode=AutoresetMode.SAME_STEP,
        max_episode_steps=[lengths[i % len(lengths)] for i in range(num_envs)],
        plant=plant,
        scenario=scenario,
        parameters=parameters,
        conditions=CONDITIONS,
        weights=training_weights(weights),
    )
    return ScaledReward(VecMonitor(SB3VectorEnv(wrap(env))))
