"""What info holds after a step: the reward's terms and the figures behind the control aims."""

from typing import Any

from epv_env.result import StepResult
from epv_env.reward import RewardTerms

_TERMS = tuple(f"reward_{name}" for name in RewardTerms._fields)


def step_info(result: StepResult) -> dict[str, Any]:
    """Arrays (n,) by key, or Python numbers if the result holds those of one episode.

    "reward_NAME": each term of the reward; "deviation_bar": p2 - target of largest magnitude within
    the period; "switchings" of the coil; "vented_g": air blown off [g]; "consumption_g_per_s";
    "is_success": settled and inside ±500 mbar ever since.
    """
    info = dict(zip(_TERMS, result.terms, strict=True))
    info["deviation_bar"] = result.deviation_bar
    info["switchings"] = result.switchings
    info["vented_g"] = 1e3 * result.vented_kg
    info["consumption_g_per_s"] = 1e3 * result.consumption
    info["is_success"] = result.succeeded
    return info
