"""Hyperparameters of PPO: the default, and those of the training of recurrent policies."""

from dataclasses import dataclass

from epv_env.conditions import CONDITIONS, Conditions
from epv_env.reward import BAND_BAR, RewardWeights


@dataclass(frozen=True, kw_only=True)
class Hyperparameters:
    """What defines a training with PPO; the rest is stable-baselines3's default."""

    num_envs: int = 1024
    """Episodes that run side by side."""
    episode_steps: int = 600
    """Length of a training episode [control periods] (3 s)."""
    n_steps: int = 32
    """Length of a rollout between two updates [control periods]."""
    batch_size: int = 4096
    """Transitions of a gradient step."""
    n_epochs: int = 1
    """Passes over a rollout in each update. Another environment step costs less than another pass."""
    learning_rate: float = 1.5e-3
    """Adam's step size at the start; it falls linearly to `last_learning_rate`."""
    last_learning_rate: float = 2e-5
    """Adam's step size at the end."""
    reward_scale: float = 0.02
    """Factor of the rewards that the learner sees [1]. It makes the critic's errors about as large as
    the actor's advantages: PPO clips the gradients of both in common."""
    band_price: float = 6.0
    """Price of a constraint violation in training, unless the reward's own is higher. Violations are so
    rare for a good policy that learning would hardly notice them at the reward's own price."""
    band_bar: float = BAND_BAR
    """Half-width of the band with this price, at most C1's; a narrower one keeps a margin [bar]."""
    breakdown_price: float = 0.0
    """Price of the shortfall below the target in training, unless the reward's own is higher."""
    imitation_epochs: int = 2
    """Passes over the demonstration that the model imitates first (training/learners/imitation.py)."""
    sharpness: float = 1.0
    """Factor of the logits of a student to go on from [1]: the larger, the less it explores."""
    gamma: float = 0.995
    """Discount factor of a control period [1]."""
    gae_lambda: float = 0.95
    """Decay of the generalised advantage estimate (Schulman et al., ICLR 2016) [1]."""
    ent_coef: float = 0.003
    """Entropy coefficient at the start [1]; it falls linearly to zero."""
    width: int = 64
    """Units of each of the two hidden layers."""
    validations: int = 8
    """Number of validated policies, evenly from `first_validation` to the end."""
    first_validation: float = 0.75
    """Share of the training before the first validation [1]."""
    validation_episodes: int = 512
    """Episodes of a validation."""
    validation_duration: float = 6.0
    """Length of a validation episode [s]."""
    conditions: Conditions = CONDITIONS["ordinary"]
    """What training episodes may meet beyond the ordinary; validation episodes are ordinary."""


FROM_STUDENT = Hyperparameters(
    band_price=10.0, band_bar=0.32, breakdown_price=2.0, sharpness=3.0, ent_coef=0.0,
    learning_rate=1.5e-4, last_learning_rate=5e-6, batch_size=2048, gae_lambda=0.98,
    validations=5, first_validation=0.2,
)  # fmt: skip
"""For a recurrent policy that goes on from its student.

Episodes are ordinary: the unavoidable price of starts far below the target would drown what the others
teach. The student knows such starts from its lessons.

One control period more of a pulse is worth 200 mbar, so more exploration than the student's own doubt
teaches caution only. The student keeps within the band, so the prices near the band's edge and of a
breakdown can be higher."""

FROM_MEMORYLESS = Hyperparameters(learning_rate=4e-4, breakdown_price=0.6, first_validation=0.05)
"""For a recurrent policy that goes on from a policy without memory, where switching is cheap."""


def switching_is_cheap(weights: RewardWeights) -> bool:
    """Whether a switching costs less than by default: frequent switching, unlike the student's, pays."""
    return weights.switching < RewardWeights().switching


def recurrent_hyperparameters(weights: RewardWeights) -> Hyperparameters:
    """PPO's hyperparameters for a recurrent policy at these prices of the reward."""
    return FROM_MEMORYLESS if switching_is_cheap(weights) else FROM_STUDENT
