"""How much higher than it has learned a policy holds p2: the last thing that training settles.

Some training seeds leave the band more often downwards, others upwards, and both are so rare that PPO
hardly feels them. How high p2 is held can be changed without learning: the policy is shown a lower or
higher p2. So a few heights are tried on the validation episodes.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from controllers.learned import LearnedPolicy
from epv_env.observation import INDEX, LAYOUT
from training.learners.validation import ValidationSettings, score, validate

ERROR = INDEX["p2_error"]
VIOLATION_PRICE = 3000.0
"""Loss of score by an episode with a constraint violation, beside its return: the band comes first."""


def raised(policy: LearnedPolicy, by_bar: float) -> LearnedPolicy:
    """The policy that holds p2 higher: it acts as `policy` does where p2 is lower by this much [bar].

    The entry p2 - target acts through the first layers' weights, so their biases take the shift.
    """
    shift = by_bar / LAYOUT[ERROR].scale
    (weight, bias), *rest = policy.layers
    layers = [(weight, (bias - weight[:, ERROR] * shift).astype(bias.dtype)), *rest]
    cell = policy.cell
    if cell is not None:
        lower = cell.bias_input - cell.weight_input[:, ERROR] * shift
        cell = replace(cell, bias_input=lower.astype(cell.bias_input.dtype))
    return replace(policy, layers=layers, cell=cell)


def best_raised(
    policy: LearnedPolicy,
    candidates_bar: Sequence[float],
    settings: ValidationSettings,
    options: dict[str, Any],
) -> LearnedPolicy:
    """The best of the policy raised by each of the candidates [bar], on the validation episodes.

    options: of the environment.
    """
    if not any(candidates_bar):
        return policy
    each = [raised(policy, by_bar) for by_bar in candidates_bar]
    return max(each, key=lambda one: score(validate(one, settings, options), VIOLATION_PRICE))
