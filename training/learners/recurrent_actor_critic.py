"""Networks of a recurrent policy's training: the student as actor, and a critic that sees more."""

from typing import Any

import torch
from gymnasium.spaces import Box, Space
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.type_aliases import Schedule
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from controllers.learned import LearnedPolicy
from epv_env.observation import LAYOUT
from training.learners.student import Student, policy_of, put_policy


class RecurrentActorCritic(BasePolicy):
    """An actor that reads an ECU's entries and remembers, and a critic that reads all entries.

    The observations' first entries are an ECU's (epv_env.observation.LAYOUT); what follows is for the
    critic alone (training/learners/privileged_wrapper.py).
    """

    def __init__(
        self,
        observation_space: Box,
        action_space: Space,
        lr_schedule: Schedule,
        use_sde: bool = False,
        *,
        memory: int,
        width: int,
        critic_width: int,
        averaging: float,
        optimizer_kwargs: dict[str, Any],
    ):
        """
        Args:
            observation_space: of the environment.
            action_space: of the environment: two actions.
            lr_schedule: step size by the share of the training that remains [1].
            use_sde: of stable-baselines3, which passes it; False.
            memory: cells of the actor's recurrent unit.
            width: units of each of the actor's hidden layers.
            critic_width: units of each of the critic's.
            averaging: factor by which the weight of an actor in the average falls with each update [1].
            optimizer_kwargs: of Adam.
        """
        super().__init__(observation_space, action_space)
        assert not use_sde
        self.actor = Student(memory=memory, width=width)
        self.critic = torch.nn.Sequential(
            torch.nn.Linear(observation_space.shape[0], critic_width), torch.nn.Tanh(),
            torch.nn.Linear(critic_width, critic_width), torch.nn.Tanh(),
            torch.nn.Linear(critic_width, 1),
        )  # fmt: skip
        self.average = AveragedModel(self.actor, multi_avg_fn=get_ema_multi_avg_fn(averaging))
        """Of the actors after the latest updates, with exponentially falling weights."""
        groups = [{"params": self.actor.parameters()}, {"params": self.critic.parameters()}]
        self.optimizer = torch.optim.Adam(groups, lr=lr_schedule(1), **optimizer_kwargs)

    def values(self, observations: torch.Tensor) -> torch.Tensor:
        """What the critic expects, (...,); observations: (..., entries)."""
        return self.critic(observations)[..., 0]

    def log_odds(self, observations: torch.Tensor, before: torch.Tensor) -> torch.Tensor:
        """Of energising the coil, (windows, periods); observations: (windows, periods, entries).

        before: recurrent state that each window begins with, (windows, cells).
        """
        return self.actor(observations[..., : len(LAYOUT)], before)

    def go_on_from(self, policy: LearnedPolicy, sharpness: float) -> None:
        """Make the actor that of a policy of the same shape, its logits times `sharpness`."""
        put_policy(self.actor, policy, sharpness)
        self.average.module.load_state_dict(self.actor.state_dict())

    def greedy(self) -> LearnedPolicy:
        """The greedy policy of the averaged actor, with a copy of its weights.

        It is steadier than the latest one (Izmailov et al., Averaging weights leads to wider optima, UAI
        2018).
        """
        averaged = self.average.module
        assert isinstance(averaged, Student)
        return policy_of(averaged)

    def averaged(self) -> None:
        """Take the present actor into the average."""
        self.average.update_parameters(self.actor)

    def _predict(self, observation: Any, deterministic: bool = False) -> torch.Tensor:
        raise NotImplementedError("a recurrent policy acts through `greedy`, which remembers")
