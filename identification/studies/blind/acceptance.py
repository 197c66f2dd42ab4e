"""Acceptance criteria of the diagnosis."""

import math
from dataclasses import dataclass

from identification.studies.blind.settings import DEFAULTS, STRONG


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


CALIBRATION_CRITERION = AcceptanceCriterion(name="calibration error of the first cause", most=0.05)
"""Of the stated probabilities: bins of equal width (calibration.py)."""

ACCEPTANCE_CRITERIA = (
    AcceptanceCriterion(name="false alarms without an effect", most=0.0),
    AcceptanceCriterion(name="truth in the ambiguity set", least=0.96),
    AcceptanceCriterion(name="mean size of the ambiguity set", most=1.5),
    AcceptanceCriterion(name="first cause right, ties counted as wrong", least=0.90),
    AcceptanceCriterion(name="first cause right, where data can tell", least=0.90),
    AcceptanceCriterion(name="component right", least=0.95),
    AcceptanceCriterion(name="unknown where the effect is struck", least=0.87),
    AcceptanceCriterion(name="mean probability on the truth", least=0.85),
    AcceptanceCriterion(name="shrink inside its 90 % interval", least=0.85, most=0.95),
    AcceptanceCriterion(name="seconds per diagnosis", most=60.0),
    CALIBRATION_CRITERION,
)
"""The project's criteria: proportions, means and errors [-], except the time [s]."""

CRITERIA_OF_FORMS = {DEFAULTS.forms: ACCEPTANCE_CRITERIA, STRONG.forms: (CALIBRATION_CRITERION,)}
"""Criteria of each study by the name of its forms. Where forms are far off, a cause need not be found,
but a probability must still mean what it says."""
