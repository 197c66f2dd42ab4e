"""The environment that PPO trains on: drawn plants, scaled rewards, what a recurrent policy needs."""

from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper, VecMonitor
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from controllers.governor import Governor
from controllers.learned import GatedUnit
from controllers.pulse_simulation import nominal_table
from epv_env.actions import OnOff
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from epv_env.sb3 import make_sb3_env
from training.evaluation.seeds import training_seeds
from training.learners.governed_wrapper import GovernedWrapper
from training.learners.hyperparameters import Hyperparameters
from training.learners.privileged_wrapper import PrivilegedWrapper
from training.learners.recurrent_state_wrapper import RecurrentStateWrapper


class ScaledReward(VecEnvWrapper):
    """Rewards times a constant; the monitor inside counts them as they are."""

    def __init__(self, env: VecMonitor, scale: float):
        """scale: factor of the rewards [1]."""
        super().__init__(env)
        self._scale = scale

    def reset(self) -> VecEnvObs:
        """First observations (n, entries)."""
        return self.venv.reset()

    def step_wait(self) -> VecEnvStepReturn:
        """Observations (n, entries), scaled rewards (n,), ends (n,) and infos."""
        observation, reward, done, infos = self.venv.step_wait()
        return observation, self._scale * reward, done, infos


def seed_episodes(env: VecEnv, seed: int) -> None:
    """Give the environments the first episodes of the training with this seed.

    Raises ValueError if the seed is too large (training/evaluation/seeds.py).
    """
    env.seed(training_seeds(seed, env.num_envs)[0])


def make_training_env(
    h: Hyperparameters,
    *,
    plant: Plant,
    scenario: str,
    parameters: str,
    seed: int,
    weights: RewardWeights,
    cell: GatedUnit | None = None,
    privileged: bool = False,
) -> VecEnvWrapper:
    """Episodes on drawn plants. Trainings with different seeds meet different episodes.

    Args:
        h: hyperparameters, of which the number, lengths and conditions of episodes, the reward's scale
            and the charge for leaving count.
        plant: centre of the region.
        scenario: of the consumption.
        parameters: region that plants are drawn from, "confidence" or another (epv_env.settings).
        seed: of the training.
        weights: prices of the reward.
        cell: a unit whose state ends the observations (training/learners/recurrent_state_wrapper.py).
        privileged: whether observations end with a critic's view instead, leaving the band is charged
            (training/learners/privileged_wrapper.py), and a supervisor's governor corrects the actions
            (training/learners/governed_wrapper.py).

    Raises:
        ValueError: the seed is too large (training/evaluation/seeds.py).
    """
    lengths = h.episode_lengths
    env = make_sb3_env(
        "EPValve-v0",
        h.num_envs,
        max_episode_steps=lengths,
        plant=plant,
        parameters=parameters,
        scenario=scenario,
        weights=weights,
        conditions=h.conditions,
        privileged=privileged,
    )
    seed_episodes(env, seed)
    if privileged:
        judged = PrivilegedWrapper(
            VecMonitor(env), scale=h.reward_scale, charge=h.leaving_charge,
            margin_bar=h.leaving_margin_bar, longest=max(lengths),
        )  # fmt: skip
        period = OnOff.default_period
        return GovernedWrapper(judged, Governor(nominal_table(plant), control_period=period))
    scaled = ScaledReward(VecMonitor(env), h.reward_scale)
    return RecurrentStateWrapper(scaled, cell) if cell else scaled
