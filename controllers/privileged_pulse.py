"""The privileged pulse controller: it knows each valve's own plant parameters.

No ECU knows these parameters, so the controller shows what knowing them is worth. It measures the state
as the other controllers do and has no foresight. A recurrent policy imitates it first
(training/learners/distillation.py).
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.pulse import Pulse
from controllers.pulse_simulation import pulse_tables
from controllers.registration import TABLE_PER_PLANT, Registration
from epv_env.task import LimitingTask

WITH_RESERVE: dict[str, Any] = {
    "aim": 0.10, "filter_time": 0.0125, "look_ahead": 1.5, "rounding": 0.8, "tolerated": 0.42,
}  # fmt: skip
"""Settings that hold a reserve where the valve is slow, near the best of 200 settings that TPE tried on
384 tuning episodes, many of them hard. Within 512 episodes of which half are emergencies none left."""


@dataclass(kw_only=True)
class PrivilegedPulse:
    """Acts on the measurements of the episodes that it watches.

    The quantities are `Pulse`'s. Their defaults were chosen by hand, near the best of 115 settings that
    TPE tried on 384 validation episodes of the calibrated plant: where breakdown and rms error are small
    together, at ten switchings a second.
    """

    trigger: float = -0.06
    """Predicted p2 - target below which a pulse begins [bar]."""
    aim: float = 0.125
    """p2 - target at which a pulse shall end [bar]."""
    filter_time: float = 0.009
    """Time in which the weight of a reading of p2 fades by 1/e [s]."""
    look_ahead: float = 1.45
    """Share of the time to open over which p2 is extrapolated [1]."""
    rounding: float = 0.77
    """Remaining time below which a pulse ends now [control periods]."""
    tolerated: float = np.inf
    """Expected breakdown that needs no reserve [bar]; infinite: none is held."""
    name: str = "pulse, informed"
    environment: str = "EPValve-v0"
    _pulse: Pulse | None = field(default=None, repr=False)

    def reset(self, n: int) -> None:
        """Nothing to forget: `watch` begins each batch anew."""

    def watch(self, task: LimitingTask) -> None:
        """Make the tables of the episodes that have just begun (controllers.base.Privileged).

        A plant met for the first time takes a fifth of a second. Raises ValueError unless trigger < aim.
        """
        plants = [parameters for parameters in task.parameters if parameters is not None]
        assert len(plants) == task.n, "the episodes must have begun"
        self._pulse = Pulse(
            table=pulse_tables(plants, task.settings.supply_voltage), trigger=self.trigger, aim=self.aim,
            filter_time=self.filter_time, look_ahead=self.look_ahead, rounding=self.rounding,
            tolerated=self.tolerated,
        )  # fmt: skip
        self._pulse.reset(task.n)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,). Raises ValueError if no task is watched."""
        if self._pulse is None:
            raise ValueError(
                "the privileged pulse controller sees no task: call watch(env.task) after the reset"
            )
        return self._pulse.act(observations)


REGISTRATION = Registration(
    kind="pulse, informed",
    controller=PrivilegedPulse,
    build=lambda values, plant: PrivilegedPulse(),
    search_space=None,
    cost=TABLE_PER_PLANT,
)
