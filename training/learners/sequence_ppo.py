"""PPO for a recurrent policy: gradients go through the recurrent unit over the periods of a rollout.

Each rollout is a window of every episode. The actor learns from whole windows that begin with the
recurrent state which the episode had there, so the state reaches further back than the gradients
(truncated backpropagation through time: Williams and Peng, Neural Computation 2 (1990)). Episodes last
whole numbers of windows. A window in which an episode fails and another begins teaches the critic only.
"""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv
from torch.nn.functional import logsigmoid, mse_loss

from epv_env.observation import LAYOUT
from training.learners.batch_ppo import BatchPPO, clipped_objective
from training.learners.recurrent_actor_critic import RecurrentActorCritic


class SequencePPO(BatchPPO):
    """PPO for two actions with a RecurrentActorCritic.

    ent_coef and vf_coef have no effect: no entropy is paid for, and the critic has weights of its own.
    """

    policy: RecurrentActorCritic  # type: ignore[assignment]

    def __init__(
        self,
        *arguments: Any,
        critic_rate: float = 1.0,
        critic_first: int = 0,
        restarts: float = 0.0,
        **options: Any,
    ):
        """
        Args:
            arguments: of PPO.
            critic_rate: the critic's learning rate over the actor's [1].
            critic_first: environment steps in which only the critic learns.
            restarts: probability that an episode's control unit restarts after a rollout [1].
            options: of PPO.
        """
        self.memory: NDArray = np.zeros((0, 0), dtype=np.float32)
        """Recurrent state of the episodes (n, cells)."""
        self._critic_rate, self._critic_first = critic_rate, critic_first
        self._restarts = restarts
        super().__init__(*arguments, **options)

    def _setup_model(self) -> None:
        super()._setup_model()
        cells = self.policy.actor.memory.hidden_size
        self.memory = np.zeros((self.n_envs, cells), dtype=np.float32)

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), "memory", "_before", "_log_odds"]

    def collect_rollouts(
        self, env: VecEnv, callback: BaseCallback, rollout_buffer: RolloutBuffer, n_rollout_steps: int
    ) -> bool:
        """Fill the buffer with n_rollout_steps periods. Returns False where a callback asks to stop."""
        assert self._last_episode_starts is not None
        self.memory[self._last_episode_starts.astype(bool)] = 0.0
        self._before = torch.from_numpy(self.memory.copy())
        self._log_odds: list[torch.Tensor] = []
        goes_on = super().collect_rollouts(env, callback, rollout_buffer, n_rollout_steps)
        # Now, not before the next rollout: checkpoints are written between both.
        self.memory[(torch.rand(self.n_envs) < self._restarts).numpy()] = 0.0
        return goes_on

    def train(self) -> None:
        """Update the networks on the rollout: PPO's clipped objective."""
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.policy.optimizer)
        _, critic = self.policy.optimizer.param_groups
        critic["lr"] *= self._critic_rate
        assert callable(self.clip_range)
        clip = self.clip_range(self._current_progress_remaining)
        buffer = self.rollout_buffer
        windows = self._windows(buffer)
        figures = torch.zeros(5)
        count = 0
        for _ in range(self.n_epochs):
            for rows in torch.randperm(buffer.n_envs).split(self.batch_size // buffer.buffer_size):
                figures += self._learn(*(part[rows] for part in windows), clip=clip)
                count += 1
            self._n_updates += 1
        self.policy.averaged()
        self._record(figures / count, clip)

    def _windows(self, buffer: RolloutBuffer) -> list[torch.Tensor]:
        """Of every episode: observations (n, periods, entries); actions, log probabilities, advantages
        and returns (n, periods); the recurrent state before (n, cells); whether it is whole (n, 1)."""
        advantages = buffer.advantages
        normal = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        series = (
            buffer.observations, buffer.actions[..., 0], buffer.log_probs, normal, buffer.returns,
        )  # fmt: skip
        whole = buffer.episode_starts[1:].sum(axis=0)[:, None] == 0
        return [
            *(torch.from_numpy(np.ascontiguousarray(part.swapaxes(0, 1))) for part in series),
            self._before, torch.from_numpy(whole.astype(np.float32)),
        ]  # fmt: skip

    def _learn(
        self,
        observations: torch.Tensor,
        actions: torch.Tensor,
        old: torch.Tensor,
        advantages: torch.Tensor,
        returns: torch.Tensor,
        before: torch.Tensor,
        whole: torch.Tensor,
        *,
        clip: float,
    ) -> torch.Tensor:
        """One gradient step on windows (m, ...). Returns the figures of `BatchPPO._step`, (5,)."""
        value_loss = mse_loss(self.policy.values(observations), returns)
        figures = torch.zeros(5)
        loss = value_loss
        if self.num_timesteps > self._critic_first:
            odds = self.policy.log_odds(observations, before)
            change = log_probability(odds, actions) - old
            parts = clipped_objective(change, advantages, clip)
            gain, divergence, clipped = ((whole * part).mean() for part in parts)
            loss = value_loss - gain
            with torch.no_grad():
                chance = odds.sigmoid()
                entropy = -(chance * logsigmoid(odds) + (1 - chance) * logsigmoid(-odds)).mean()
                figures = torch.stack([-gain, value_loss, -entropy, divergence, clipped])
        self.policy.optimizer.zero_grad()
        loss.backward()
        for part in (self.policy.actor, self.policy.critic):
            torch.nn.utils.clip_grad_norm_(part.parameters(), self.max_grad_norm, foreach=True)
        self.policy.optimizer.step()
        return figures

    def _sampled(self, observation: NDArray, chance: torch.Tensor) -> NDArray:
        """Actions (n,) drawn from the policy; chance: uniform in [0, 1), (n, 1)."""
        assert self._last_episode_starts is not None
        self.memory[self._last_episode_starts.astype(bool)] = 0.0
        with torch.no_grad():
            seen = torch.from_numpy(np.ascontiguousarray(observation[:, : len(LAYOUT)]))
            odds, memory = self.policy.actor.step(seen, torch.from_numpy(self.memory))
        self.memory = memory.numpy()
        self._log_odds.append(odds)
        return (chance[:, 0] < odds.sigmoid()).numpy().astype(np.int64)

    def _evaluate(self, buffer: RolloutBuffer) -> None:
        """Values and log probabilities of the rollout."""
        for k, observations in enumerate(buffer.observations):
            taken = torch.from_numpy(buffer.actions[k, :, 0])
            buffer.log_probs[k] = log_probability(self._log_odds[k], taken).numpy()
            buffer.values[k] = self._critic(torch.from_numpy(observations)).numpy()

    def _critic(self, observations: torch.Tensor) -> torch.Tensor:
        """Values (n,); observations: (n, entries)."""
        return self.policy.values(observations)


def log_probability(odds: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
    """Of actions 0 and 1 whose log odds of 1 are given; shapes alike."""
    return logsigmoid(torch.where(actions > 0.5, odds, -odds))
