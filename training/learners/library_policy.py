"""A model of stable-baselines3 or sb3-contrib as a controller."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm


@dataclass(kw_only=True)
class LibraryPolicy:
    """Deterministic actions of a trained model, recurrent ones included."""

    model: BaseAlgorithm
    environment: str
    """Id of the environment that it was trained on."""
    name: str = "policy"
    _state: Any = field(default=None, init=False, repr=False)
    _begins: NDArray = field(default_factory=lambda: np.empty(0, dtype=bool), init=False, repr=False)

    def reset(self, n: int) -> None:
        """Forget everything; n episodes begin."""
        self._state = None
        self._begins = np.ones(n, dtype=bool)

    def act(self, observations: NDArray) -> NDArray:
        """Actions of the environment's action space for observations (n, entries): (n,) or (n, 1)."""
        actions, self._state = self.model.predict(
            observations, state=self._state, episode_start=self._begins, deterministic=True
        )
        self._begins = np.zeros(len(observations), dtype=bool)
        return actions
