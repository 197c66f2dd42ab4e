"""What changes as a training goes on: learning rate and exploration fall linearly."""

from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback


def linear(first: float, last: float, remaining: float) -> float:
    """The value between `first` and `last` when the share `remaining` of a training lies ahead [1]."""
    return last + (first - last) * remaining


class FadingEntropy(BaseCallback):
    """Lowers PPO's entropy bonus linearly to zero, since the policy is used greedily in the end."""

    def __init__(self, first: float, *, total: int):
        """
        Args:
            first: entropy coefficient at the start [1].
            total: environment steps of the whole training.
        """
        super().__init__()
        self._first = first
        self._total = total

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        assert isinstance(self.model, PPO)
        self.model.ent_coef = linear(self._first, 0.0, max(1 - self.num_timesteps / self._total, 0.0))
