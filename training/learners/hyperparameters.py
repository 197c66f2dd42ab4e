"""Hyperparameters of PPO: the default, and those of the training of recurrent policies."""

from dataclasses import dataclass, replace

from epv_env.conditions import CONDITIONS, Conditions
from epv_env.reward import BAND_BAR, RewardWeights


@dataclass(frozen=True, kw_only=True)
class Hyperparameters:
    """What defines a training with PPO; the rest is stable-baselines3's default."""

    num_envs: int = 1024
    """Episodes that run side by side."""
    episode_steps: int = 600
    """Length of the shortest training episodes [control periods] (3 s)."""
    longest_episode_steps: int | None = None
    """Length of the longest [control periods]; the others' lie between, a rollout apart. None: all
    have one length."""
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
    switching_price: float = 0.0
    """Price of a switching in training, unless the reward's own is higher."""
    imitation_epochs: int = 2
    """Passes over the demonstration that the model imitates first (training/learners/imitation.py)."""
    end_to_end: bool = False
    """Whether gradients go through a student's recurrent unit (training/learners/sequence_ppo.py). The
    critic then sees more than the actor, a governor corrects the actions, the fields up to `averaging`
    count, and `ent_coef` does not."""
    leaving_charge: float = 0.0
    """Price of a training episode that leaves the band with a margin, once."""
    leaving_margin_bar: float = BAND_BAR
    """Deviation from the target that counts as leaving [bar]."""
    critic_width: int = 128
    """Units of each of the critic's hidden layers."""
    critic_rate: float = 6.0
    """Learning rate of the critic over the actor's [1]."""
    critic_first: int = 0
    """Environment steps in which the critic learns alone."""
    restarts: float = 0.0
    """Probability that an episode's control unit restarts, and forgets everything, after a rollout."""
    averaging: float = 0.99
    """Factor by which an actor's weight in the average falls with each update [1]."""
    sharpness: float = 1.0
    """Factor of the logits of a student to go on from [1]: the larger, the less it explores."""
    gamma: float = 0.995
    """Discount factor of a control period [1]."""
    clip_range: float = 0.2
    """Share by which an update may change the probability of an action before it is clipped [1]."""
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
    validation_conditions: Conditions = CONDITIONS["ordinary"]
    """What validation episodes may meet beyond the ordinary."""
    conditions: Conditions = CONDITIONS["ordinary"]
    """What training episodes may meet beyond the ordinary."""

    @property
    def episode_lengths(self) -> list[int]:
        """Length of each environment's episodes, (num_envs,) [control periods].

        Different lengths keep the environments out of step: every rollout sees all parts of an episode.
        """
        longest = self.longest_episode_steps or self.episode_steps
        between = range(self.episode_steps, longest + 1, self.n_steps)
        return [between[i % len(between)] for i in range(self.num_envs)]


FROM_STUDENT = Hyperparameters(
    band_price=10.0, band_bar=0.28, breakdown_price=0.5, sharpness=3.0, ent_coef=0.0,
    learning_rate=4e-4, last_learning_rate=5e-6, batch_size=2048, gae_lambda=0.98,
    validations=3, first_validation=0.5, validation_episodes=1024,
    validation_conditions=Conditions(extreme=0.5, braking=0.5),
    conditions=Conditions(extreme=0.5, braking=0.3),
)  # fmt: skip
"""For a recurrent policy that goes on from its student.

A good policy leaves the band only where a slow or fast valve meets an emergency. Both are rare in
ordinary episodes, so training and validation make them frequent. Starts far below the target, which the
student knows from its lessons, are left out: their unavoidable price would drown what the others teach.

One control period more of a pulse is worth 200 mbar, so more exploration than the student's own doubt
teaches caution only. The student keeps within the band, so the price near the band's edge can be higher.
At a breakdown price of 2 policies stayed above the target, switched more and lost return."""

FROM_MEMORYLESS = Hyperparameters(learning_rate=4e-4, breakdown_price=0.6, first_validation=0.05)
"""For a recurrent policy that goes on from a policy without memory, where switching is cheap."""

END_TO_END = Hyperparameters(
    end_to_end=True, n_steps=50, batch_size=1600, longest_episode_steps=2000, learning_rate=3e-4,
    last_learning_rate=1e-5, critic_first=1_000_000, clip_range=0.1, gae_lambda=0.98, ent_coef=0.0,
    sharpness=4.0, restarts=0.01, leaving_charge=300.0, leaving_margin_bar=0.38, band_price=10.0,
    band_bar=0.30, breakdown_price=0.5, switching_price=1.0, imitation_epochs=0,
    validations=4, first_validation=0.6, validation_episodes=1024,
    validation_conditions=Conditions(extreme=0.5, braking=0.5),
    conditions=Conditions(
        extreme=0.5, braking=0.3, far=0.06, vented=0.12, coil_off=0.08, starved=0.12, rest=0.05,
        rest_s=(2.0, 8.0), target_steps=0.1, noisy=0.2, frozen_p3=0.05, biased_p2=0.05, delayed=0.15,
    ),
)  # fmt: skip
"""For a recurrent policy that goes on from its student, the recurrent unit included.

Long episodes teach it to remember. Plants from the region's corners and hard applications are frequent,
since a good policy leaves the band only where they meet. The margin's price alone would make a policy
keep p3 ready and switch 20 times a second and more; the higher price of a switching keeps it to the
student's way, rest between applications. It learns under the governor that it will act with."""


def training_weights(weights: RewardWeights, h: Hyperparameters) -> RewardWeights:
    """Prices of the reward in training: at least those of the hyperparameters, on at most their band."""
    return replace(
        weights,
        band=max(weights.band, h.band_price),
        band_bar=min(weights.band_bar, h.band_bar),
        breakdown=max(weights.breakdown, h.breakdown_price),
        switching=max(weights.switching, h.switching_price),
    )


def switching_is_cheap(weights: RewardWeights) -> bool:
    """Whether a switching costs less than by default: frequent switching, unlike the student's, pays."""
    return weights.switching < RewardWeights().switching


def recurrent_hyperparameters(weights: RewardWeights, *, end_to_end: bool = False) -> Hyperparameters:
    """PPO's hyperparameters for a recurrent policy at these prices of the reward.

    end_to_end: whether the recurrent unit learns, too.
    """
    if end_to_end:
        return END_TO_END
    return FROM_MEMORYLESS if switching_is_cheap(weights) else FROM_STUDENT
