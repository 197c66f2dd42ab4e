"""Acceptance criteria of the diagnosis."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class AcceptanceCriterion:
    """The values of a proportion or mean with which the diagnosis is accepted."""

    name: str
    """Of the proportion or mean, as in results.json."""
    least: float = -math.inf
    """Smallest accepted value, in the unit of the quantity."""
    most: float = math.inf
    """Largest accepted value, in the unit of the quantity."""

    def is_met(self, value: float | None) -> bool | None:
        """Whether a value is accepted; None where nothing was measured."""
        return None if value is None else self.least <= value <= self.most

    @property
    def requirement(self) -> str:
        """The accepted values, ready to read."""
        if self.most == math.inf:
            return f"at least {self.least:g}"
        if self.least > 0:
            return f"{self.least:g} to {self.most:g}"
        return f"at most {self.most:g}"


ACCEPTANCE_CRITERIA = (
    AcceptanceCriterion(name="false alarms without an effect", most=0.05),
    AcceptanceCriterion(name="truth in the ambiguity set", least=0.95),
    AcceptanceCriterion(name="mean size of the ambiguity set", most=1.5),
    AcceptanceCriterion(name="first cause right", least=0.90),
    AcceptanceCriterion(name="first cause right, where data can tell", least=0.90),
    AcceptanceCriterion(name="component right", least=0.95),
    AcceptanceCriterion(name="unknown where the effect is struck", least=0.85),
    AcceptanceCriterion(name="mean probability on the truth", least=0.85),
    AcceptanceCriterion(name="shrink inside its 90 % interval", least=0.85, most=0.95),
    AcceptanceCriterion(name="seconds per diagnosis", most=60.0),
)
"""The project's criteria: proportions and means [-], except the time [s]."""
