"""What changes as training goes on: exploration fades."""

from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback


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
