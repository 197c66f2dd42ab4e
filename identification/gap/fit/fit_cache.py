"""Cache of finished fits: an interrupted diagnosis continues where it stopped."""

from collections.abc import Callable
from typing import Any

import numpy as np

from epv_env.common.files import Journal
from identification.gap.fit.hypothesis import Estimate, Hypothesis
from identification.gap.model.grey_box import GreyBox


class FitCache:
    """Runs the steps of a diagnosis; a step that the journal holds is not run again."""

    def __init__(
        self,
        plant: GreyBox,
        journal: Journal | None = None,
        announce: Callable[[str], None] = lambda step: None,
        prefix: str = "",
    ):
        """Begin with the fits of a journal.

        Args:
            plant: the plant to whose causes the journal refers.
            journal: finished fits; None keeps nothing.
            announce: called with the name of every step before it begins.
            prefix: of the names of all steps.
        """
        self.plant = plant
        self.journal = journal
        self.announce = announce
        self.prefix = prefix

    def named(self, prefix: str) -> "FitCache":
        """The same cache for a second search: all names of steps begin with the prefix."""
        return FitCache(self.plant, self.journal, self.announce, prefix)

    def __call__(self, step: str, fit: Callable[[], list[Estimate]]) -> list[Estimate]:
        """The estimates that `fit` returns, or returned in an earlier run under this step's name."""
        step = self.prefix + step
        self.announce(step)
        if self.journal is not None and step in self.journal:
            return [self._estimate(entry) for entry in self.journal[step]]
        estimates = fit()
        if self.journal is not None:
            self.journal.add(step, [_entry(estimate) for estimate in estimates])
        return estimates

    def _estimate(self, entry: dict[str, Any]) -> Estimate:
        causes = {cause.label: cause for cause in self.plant.causes}
        runs = len(self.plant.runs)
        return Estimate(
            hypothesis=Hypothesis(causes=tuple(causes[label] for label in entry["causes"])),
            vector=np.array(entry["vector"]),
            run_values=np.array(entry["local"]).reshape(runs, -1),
            chi_square=entry["chi_square"],
            converged=entry["converged"],
        )


def _entry(estimate: Estimate) -> dict[str, Any]:
    """An estimate as the journal keeps it; nuisance slopes are computed again."""
    return {
        "causes": list(estimate.hypothesis.labels),
        "vector": estimate.vector.tolist(),
        "local": estimate.run_values.tolist(),
        "chi_square": estimate.chi_square,
        "converged": estimate.converged,
    }
