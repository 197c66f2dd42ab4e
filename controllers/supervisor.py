"""A supervisor around a learned policy: it corrects the policy by what it learns about the valve."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller, Graded, Privileged, with_period
from controllers.governor import Advice, Governor, lowered
from controllers.pulse_table import PulseTable
from controllers.supervisor_settings import SETTINGS, SupervisorSettings


@dataclass(kw_only=True)
class Supervisor:
    """Lets `main` act as a governor advises (controllers/governor.py)."""

    main: Controller
    """For the on/off environment."""
    table: PulseTable
    """Of the nominal plant."""
    settings: SupervisorSettings = SETTINGS
    control_period: float = 5e-3
    """[s]"""
    name: str = field(init=False)
    environment: str = field(init=False)
    governor: Governor = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if isinstance(self.main, Privileged):
            raise ValueError(
                f"{self.main.name!r} reads no sensor: give a controller that acts on readings"
            )
        if self.main.environment != "EPValve-v0":
            raise ValueError(
                f"{self.main.name!r} is for {self.main.environment}: a supervisor ends pulses of the "
                "coil, give a controller for EPValve-v0"
            )
        self.main = with_period(self.main, self.control_period)
        self.name, self.environment = f"{self.main.name}, supervised", self.main.environment
        self.governor = Governor(self.table, self.settings, control_period=self.control_period)

    def reset(self, n: int) -> None:
        """Forget the valves; n episodes begin."""
        self.main.reset(n)
        self.governor.reset(n)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        advice = self.governor.advise(observations)
        asked = self._asked(lowered(observations, advice.shift), advice)
        actions = np.where(advice.must_shut, 1, asked)
        self.governor.decided(actions)
        return actions

    def _asked(self, shown: NDArray, advice: Advice) -> NDArray:
        """What the policy asks for clearly (n,)."""
        if not isinstance(self.main, Graded):
            return self.main.act(shown)
        logits = self.main.logits(shown)
        return np.where(logits[:, 1] - logits[:, 0] > -advice.margin, 1, 0)
