"""PPO whose rollouts and updates work on whole batches: stable-baselines3's, several times faster.

stable-baselines3 asks actor and critic in every control period, loops over all environments for their
statistics, and moves each batch through a distribution object. With many environments and small networks
this costs more than the arithmetic. Here a control period asks the actor alone; the critic and the
log probabilities follow once for the whole rollout. The algorithm, its policies, callbacks and archives
are stable-baselines3's: `PPO.load` reads a model that this class saved.
"""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.utils import explained_variance
from stable_baselines3.common.vec_env import VecEnv
from torch.nn.functional import log_softmax, mse_loss

End = tuple[int, NDArray, NDArray]
"""Control period of a rollout, indices (k,) of episodes that the time limit ended there, and their
last observations (k, entries)."""


class BatchPPO(PPO):
    """PPO for discrete actions and an actor and a critic without common layers."""

    def collect_rollouts(
        self, env: VecEnv, callback: BaseCallback, rollout_buffer: RolloutBuffer, n_rollout_steps: int
    ) -> bool:
        """Fill the buffer with n_rollout_steps periods. Returns False where a callback asks to stop."""
        assert isinstance(self._last_obs, np.ndarray)
        assert self._last_episode_starts is not None
        self.policy.set_training_mode(False)
        rollout_buffer.reset()
        callback.on_rollout_start()
        chance = torch.rand(n_rollout_steps, env.num_envs, 1)
        ends: list[End] = []
        dones = self._last_episode_starts
        for k in range(n_rollout_steps):
            actions = self._sampled(self._last_obs, chance[k])
            rollout_buffer.observations[k] = self._last_obs
            rollout_buffer.actions[k, :, 0] = actions
            rollout_buffer.episode_starts[k] = self._last_episode_starts
            observation, rollout_buffer.rewards[k], dones, infos = env.step(actions)
            assert isinstance(observation, np.ndarray)
            self.num_timesteps += env.num_envs
            callback.update_locals(locals())
            if not callback.on_step():
                return False
            ends += self._ended(k, dones, infos)
            self._last_obs, self._last_episode_starts = observation, dones
        self._judge(rollout_buffer, ends, dones)
        callback.update_locals(locals())
        callback.on_rollout_end()
        return True

    def train(self) -> None:
        """Update the policy on the rollout: PPO's clipped objective."""
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.policy.optimizer)
        assert callable(self.clip_range)
        clip = self.clip_range(self._current_progress_remaining)
        buffer = self.rollout_buffer
        figures = torch.zeros(5)
        count = 0
        tensors = [
            torch.from_numpy(part.reshape(buffer.buffer_size * buffer.n_envs, *part.shape[2:]))
            for part in (
                buffer.observations, buffer.actions.astype(np.int64), buffer.log_probs,
                buffer.advantages, buffer.returns,
            )
        ]  # fmt: skip
        for _ in range(self.n_epochs):
            for rows in torch.randperm(len(tensors[0])).split(self.batch_size):
                figures += self._step([part[rows] for part in tensors], clip)
                count += 1
            self._n_updates += 1
        self._record(figures / count, clip)

    def _record(self, figures: torch.Tensor, clip: float) -> None:
        """Log the mean figures (5,) of an update's gradient steps, named as in stable-baselines3."""
        names = ("policy_gradient_loss", "value_loss", "entropy_loss", "approx_kl", "clip_fraction")
        for name, value in zip(names, figures.tolist(), strict=True):
            self.logger.record(f"train/{name}", value)
        buffer = self.rollout_buffer
        explained = explained_variance(buffer.values.flatten(), buffer.returns.flatten())
        self.logger.record("train/explained_variance", float(explained))
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        self.logger.record("train/clip_range", clip)

    def _step(self, batch: list[torch.Tensor], clip: float) -> torch.Tensor:
        """One gradient step on observations, actions, log probabilities, advantages and returns.

        Returns losses of policy, value and entropy, divergence from the rollout's policy, and the share
        of clipped ratios, (5,).
        """
        observations, actions, before, advantages, returns = batch
        logits, values = self._actor(observations), self._critic(observations)
        every = log_softmax(logits, dim=1)
        advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        change = every.gather(1, actions)[:, 0] - before
        gain, divergence, clipped = clipped_objective(change, advantages, clip)
        entropy = -(every.exp() * every).sum(dim=1).mean()
        value_loss = mse_loss(values, returns)
        loss = -gain.mean() - self.ent_coef * entropy + self.vf_coef * value_loss
        self.policy.optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.policy.parameters(), self.max_grad_norm, foreach=True)
        self.policy.optimizer.step()
        with torch.no_grad():
            return torch.stack([-gain.mean(), value_loss, -entropy, divergence.mean(), clipped.mean()])

    def _sampled(self, observation: NDArray, chance: torch.Tensor) -> NDArray:
        """Actions (n,) drawn from the policy; chance: uniform in [0, 1), (n, 1)."""
        with torch.no_grad():
            share = self._actor(torch.from_numpy(observation)).softmax(dim=1).cumsum(dim=1)[:, :-1]
        return (chance > share).sum(dim=1).numpy()

    def _ended(self, period: int, dones: NDArray, infos: list[dict[str, Any]]) -> list[End]:
        """Take ended episodes into the statistics; returns those that the time limit ended, or none."""
        assert self.ep_info_buffer is not None
        assert self.ep_success_buffer is not None
        over = np.flatnonzero(dones)
        for i in over:
            if "episode" in infos[i]:
                self.ep_info_buffer.append(infos[i]["episode"])
            if "is_success" in infos[i]:
                self.ep_success_buffer.append(infos[i]["is_success"])
        late = np.array([i for i in over if infos[i].get("TimeLimit.truncated", False)], dtype=int)
        if not len(late):
            return []
        return [(period, late, np.array([infos[i]["terminal_observation"] for i in late]))]

    def _judge(self, buffer: RolloutBuffer, ends: list[End], dones: NDArray) -> None:
        """Values, log probabilities and advantages of the rollout.

        A time limit is no end of the task: the value of the last observation stands for what follows.
        """
        with torch.no_grad():
            self._evaluate(buffer)
            for k, late, observations in ends:
                following = self._critic(torch.from_numpy(observations)).numpy()
                buffer.rewards[k, late] += self.gamma * following
            assert isinstance(self._last_obs, np.ndarray)
            last = self._critic(torch.from_numpy(self._last_obs))
        buffer.compute_returns_and_advantage(last_values=last, dones=dones)
        buffer.full = True

    def _evaluate(self, buffer: RolloutBuffer) -> None:
        """Values and log probabilities of the rollout."""
        for k, observations in enumerate(buffer.observations):
            seen = torch.from_numpy(observations)
            every = log_softmax(self._actor(seen), dim=1)
            taken = torch.from_numpy(buffer.actions[k].astype(np.int64))
            buffer.log_probs[k] = every.gather(1, taken)[:, 0].numpy()
            buffer.values[k] = self._critic(seen).numpy()

    def _actor(self, observations: torch.Tensor) -> torch.Tensor:
        """Logits (n, actions); observations: (n, entries)."""
        return self.policy.action_net(self.policy.mlp_extractor.policy_net(observations))

    def _critic(self, observations: torch.Tensor) -> torch.Tensor:
        """Values (n,); observations: (n, entries)."""
        return self.policy.value_net(self.policy.mlp_extractor.value_net(observations))[:, 0]


def clipped_objective(
    change: torch.Tensor, advantages: torch.Tensor, clip: float
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Of each action PPO's clipped gain, divergence from the rollout's policy, and 1 if it is clipped.

    Shapes are alike, and only the gain has gradients (Schulman et al., Proximal Policy Optimization
    Algorithms, 2017, equation 7).

    Args:
        change: log probability of the action less that in the rollout.
        advantages: of the actions.
        clip: share by which the ratio of probabilities may leave 1.
    """
    ratio = change.exp()
    gain = torch.min(advantages * ratio, advantages * ratio.clamp(1 - clip, 1 + clip))
    with torch.no_grad():
        return gain, (ratio - 1) - change, ((ratio - 1).abs() > clip).float()
