"""What info holds after a step: the reward's terms and the figures behind the control aims."""

from typing import Any

from numpy.typing import NDArray

from epv_env.reward import RewardTerms
from epv_env.task import StepResult


def batch_info(result: StepResult) -> dict[str, NDArray]:
    """Arrays (n,) by key.

    "reward_NAME": each term of the reward; "deviation_bar": p2 - target of largest magnitude within
    the period; "switchings" of the coil; "vented_g": air blown off [g]; "consumption_g_per_s";
    "is_success": settled and inside ±500 mbar ever since.
    """
    infos = {f"reward_{name}": getattr(result.terms, name) for name in RewardTerms._fields}
    return infos | {
        "deviation_bar": result.deviation_bar,
        "switchings": result.switchings,
        "vented_g": 1e3 * result.vented_kg,
        "consumption_g_per_s": 1e3 * result.consumption,
        "is_success": result.succeeded,
    }


def single_info(result: StepResult) -> dict[str, Any]:
    """The same for a batch of one, as Python numbers."""
    return {key: value[0].item() for key, value in batch_info(result).items()}
