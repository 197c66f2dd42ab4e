"""What changes as training goes on: switching becomes dear, exploration fades."""

from dataclasses import replace

from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from epv_env.reward import RewardWeights


class RisingPrice(BaseCallback):
    """Raises the price of switching linearly, then leaves it at the reward's own."""

    def __init__(self, weights: RewardWeights, *, first: float, steps: float):
        """first: price at the start, at most the reward's own. steps: over which it rises."""
        super().__init__()
        self._first = min(first, weights.switching)
        self._weights = weights
        self._steps = steps

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        share = min(self.num_timesteps / self._steps, 1.0)
        price = self._first + share * (self._weights.switching - self._first)
        self.training_env.env_method("set_weights", replace(self._weights, switching=price))


class FadingEntropy(BaseCallback):
    """Lowers PPO's entropy bonus linearly to nothing: the policy is used greedily in the end."""

    def __init__(self, first: float, *, total: int):
        """first: bonus at the start. total: steps of the whole training."""
        super().__init__()
        self._first = first
        self._total = total

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        assert isinstance(self.model, PPO)
        self.model.ent_coef = self._first * max(1 - self.num_timesteps / self._total, 0.0)
