"""What info holds after a step: the reward's terms and the figures behind the control aims."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.equations import State
from epv_env.plant.parameters import table
from epv_env.result import SUCCEEDED, StepResult
from epv_env.reward import RewardTerms

KEYS = (
    *(f"reward_{name}" for name in RewardTerms._fields),
    "deviation_bar",
    "switchings",
    "vented_g",
    "consumption_g_per_s",
    "is_success",
)
"""In the order of the figures of a StepResult."""
_SHOWN = SUCCEEDED + 1

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
    info: dict[str, Any] = dict(zip(KEYS, result.figures[:_SHOWN], strict=True))
    info["switchings"] = result.switchings
    info["vented_g"] = 1e3 * result.vented_kg
    info["consumption_g_per_s"] = 1e3 * result.consumption
    info["is_success"] = result.succeeded
    return info
