"""A linearised run with one of many changes of its outputs, without another pass over its readings."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.variable_projection import (
    LinearisedRun,
    NormalEquations,
    RunProducts,
    columns_of,
    equations_of,
    with_priors,
)


class ChangedRun:
    """Products of a linearised run's columns with n changes of its outputs."""

    def __init__(self, run: LinearisedRun, changes: Sequence[NDArray], largest_deviation: float):
        """Multiply each change by the columns once.

        Args:
            run: the linearised run.
            changes: n changes of the outputs, (values,) each [noise deviations].
            largest_deviation: bound of the run's nuisance parameters [standard deviations].
        """
        self.run = run
        self.largest_deviation = largest_deviation
        columns, table = columns_of(run), np.array(changes)
        self._gram = columns.T @ columns
        self._cross = table @ columns
        self._squares = np.einsum("ij,ij->i", table, table)

    def explained(self, change: int) -> RunProducts:
        """The products after one change has been added to the model's outputs."""
        gram, cross = self._gram.copy(), self._cross[change]
        gram[0] -= cross
        gram[:, 0] -= cross
        gram[0, 0] += self._squares[change]
        return with_priors(gram, self.run, self.largest_deviation)

    def with_slope(self, change: int) -> RunProducts:
        """The products with one change as a further slope, after the others."""
        place = 1 + self.run.slopes.shape[1]
        row = np.insert(self._cross[change], place, self._squares[change])
        gram = np.insert(np.insert(self._gram, place, 0.0, axis=0), place, 0.0, axis=1)
        gram[place], gram[:, place] = row, row
        return with_priors(gram, self.run, self.largest_deviation)


class ChangedRuns:
    """Several linearised runs of one estimate, and n changes of the outputs in all of them."""

    def __init__(
        self,
        runs: Sequence[LinearisedRun],
        changes: Sequence[Sequence[NDArray]],
        largest_deviation: float,
    ):
        """Multiply each change by the columns of its run once.

        Args:
            runs: the same estimate linearised in each of them.
            changes: n changes, each per run (values,) [noise deviations].
            largest_deviation: bound of the nuisance parameters [standard deviations].
        """
        self._slopes = runs[0].slopes.shape[1]
        self._largest_deviation = largest_deviation
        self._runs = [
            ChangedRun(run, [change[r] for change in changes], largest_deviation)
            for r, run in enumerate(runs)
        ]

    def explained(self, change: int) -> NormalEquations:
        """Normal equations after one change has been added to the model's outputs."""
        products = [run.explained(change) for run in self._runs]
        return equations_of(products, self._slopes, self._largest_deviation)

    def with_slope(self, change: int) -> NormalEquations:
        """Normal equations with one change as a further slope, after the others."""
        products = [run.with_slope(change) for run in self._runs]
        return equations_of(products, self._slopes + 1, self._largest_deviation)
