"""Finished fits, kept so that an interrupted diagnosis goes on where it was."""

from collections.abc import Callable
from typing import Any

import numpy as np

from epv_env.common.journal import Journal
from identification.gap.fit.fitter import Hypothesis, Point
from identification.gap.model.grey_box import GreyBox


class Fits:
    """Runs the steps of a diagnosis; those that a journal holds are not run again."""

    def __init__(
        self,
        plant: GreyBox,
        journal: Journal | None = None,
        say: Callable[[str], None] = lambda step: None,
    ):
        """journal: None keeps nothing. say: told the name of every step that is begun."""
        self.plant = plant
        self.journal = journal
        self.say = say

    def __call__(self, step: str, fit: Callable[[], list[Point]]) -> list[Point]:
        """The points that `fit` returns, or returned in an earlier run."""
        self.say(step)
        if self.journal is not None and step in self.journal:
            return [self._point(entry) for entry in self.journal[step]]
        points = fit()
        if self.journal is not None:
            self.journal.add(step, [_entry(point) for point in points])
        return points

    def _point(self, entry: dict[str, Any]) -> Point:
        causes = {cause.label: cause for cause in self.plant.causes}
        runs = len(self.plant.runs)
        return Point(
            hypothesis=Hypothesis(causes=tuple(causes[label] for label in entry["causes"])),
            vector=np.array(entry["vector"]),
            local=np.array(entry["local"]).reshape(runs, -1),
            chi_square=entry["chi_square"],
            converged=entry["converged"],
        )


def _entry(point: Point) -> dict[str, Any]:
    return {
        "causes": list(point.hypothesis.name),
        "vector": point.vector.tolist(),
        "local": point.local.tolist(),
        "chi_square": point.chi_square,
        "converged": point.converged,
    }
