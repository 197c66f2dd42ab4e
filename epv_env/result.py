"""What a control period gave: the compiled step's table of figures, by name, and as `info` shows it."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.equations import State
from epv_env.plant.parameters import table
from epv_env.reward import RewardTerms

N_TERM = len(RewardTerms._fields)
"""Rows of the reward's terms, which begin a table of figures."""
DEVIATION, SWITCHINGS, VENTED, CONSUMPTION, SUCCEEDED, REWARD, FAILED = range(N_TERM, N_TERM + 7)
"""The other rows [SI, bar]; truth values are 0 and 1."""
N_FIGURE = FAILED + 1
"""Rows of a table of figures."""


class StepResult(NamedTuple):
    """One control period of every episode; the properties are arrays (n,)."""

    observation: NDArray
    """(n, entries) float32 [-]."""
    figures: NDArray
    """(N_FIGURE, n) in the order of this module's rows."""

    @property
    def reward(self) -> NDArray:
        """Sum of the terms, (n,) [-]."""
        return self.figures[REWARD]

    @property
    def failed(self) -> NDArray:
        """Whether the circuit is empty, or the plant left what can be integrated: it ends an episode."""
        return self.figures[FAILED] != 0

    @property
    def switchings(self) -> NDArray:
        """Switchings of the coil within the period, (n,)."""
        return self.figures[SWITCHINGS].astype(np.int64)

    @property
    def consumption(self) -> NDArray:
        """Mean consumption of the period, (n,) [kg/s]."""
        return self.figures[CONSUMPTION]


KEYS = (
    *(f"reward_{name}" for name in RewardTerms._fields),
    "deviation_bar",
    "switchings",
    "vented_g",
    "consumption_g_per_s",
    "is_success",
)
"""In the order of the figures of a StepResult."""

TRUTH_KEYS = ("true_state", "parameters")
"""Keys that an environment made with `privileged=True` shows besides."""

STATE_NAMES = State._fields
"""Entries of "true_state" [SI], as docs/explanation/plant-model.md names them."""

PARAMETER_NAMES = tuple(table())
"""Entries of "parameters" [SI], as the parameter table names them."""


def truth(state: State, parameters: NDArray) -> dict[str, NDArray]:
    """What no ECU measures, for critics and logs: by key of TRUTH_KEYS, (n, entries) [SI].

    state: fields (n,). parameters: (n, parameters), in the order of the table.
    """
    return dict(zip(TRUTH_KEYS, (np.stack(state, axis=-1), parameters.copy()), strict=True))


def step_info(result: StepResult) -> dict[str, Any]:
    """Arrays (n,) by key.

    "reward_NAME": each term of the reward; "deviation_bar": p2 - target of largest magnitude within
    the period; "switchings" of the coil; "vented_g": air blown off [g]; "consumption_g_per_s";
    "is_success": settled and inside ±500 mbar ever since.
    """
    info: dict[str, Any] = dict(zip(KEYS, result.figures[: SUCCEEDED + 1], strict=True))
    info["switchings"] = result.switchings
    info["vented_g"] = 1e3 * result.figures[VENTED]
    info["consumption_g_per_s"] = 1e3 * result.consumption
    info["is_success"] = result.figures[SUCCEEDED] != 0
    return info
