"""What a control period gave: the compiled step's table of figures, and the same by name."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.primitives.values import Value
from epv_env.reward import RewardTerms


class StepResult(NamedTuple):
    """One control period of every episode; arrays of shape (n,) unless said otherwise."""

    observation: NDArray
    """(n, entries) float32."""
    reward: Value
    """Sum of the terms [-]."""
    terms: RewardTerms
    """Contribution of each weight [-]."""
    failed: Value
    """The circuit is empty, or the plant left what can be integrated: what ends an episode."""
    deviation_bar: Value
    """p2 - target of largest magnitude within the period."""
    switchings: Value
    """Switchings of the coil within the period."""
    vented_kg: Value
    """Air blown off within the period [kg]."""
    consumption: Value
    """Mean consumption of the period [kg/s]."""
    succeeded: Value
    """Settled and never outside the band since."""


N_TERM = len(RewardTerms._fields)
"""Rows of the reward's terms, which begin a table of figures."""
REWARD, FAILED, DEVIATION, SWITCHINGS, VENTED, CONSUMPTION, SUCCEEDED = range(N_TERM, N_TERM + 7)
"""The other rows, named as the fields of StepResult; truth values are 0 and 1."""
N_FIGURE = SUCCEEDED + 1
"""Rows of a table of figures."""


def batch_result(observation: NDArray, figures: NDArray) -> StepResult:
    """Views of figures (N_FIGURE, n) for observations (n, entries)."""
    return _named(observation, list(figures), lambda row: row.astype(np.int64))


def single_result(observation: NDArray, figures: NDArray) -> StepResult:
    """The same for a batch of one, as Python numbers; observation (entries,)."""
    return _named(observation[0], figures[:, 0].tolist(), int)


def _named(observation: NDArray, rows: list[Any], whole: Callable[[Any], Any]) -> StepResult:
    """Rows of figures by name; whole: makes whole numbers of a row."""
    return StepResult(
        observation=observation,
        reward=rows[REWARD],
        terms=RewardTerms(*rows[:N_TERM]),
        failed=rows[FAILED] != 0,
        deviation_bar=rows[DEVIATION],
        switchings=whole(rows[SWITCHINGS]),
        vented_kg=rows[VENTED],
        consumption=rows[CONSUMPTION],
        succeeded=rows[SUCCEEDED] != 0,
    )
