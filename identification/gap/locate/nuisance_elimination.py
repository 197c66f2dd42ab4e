"""Elimination of parameters and nuisance parameters from forcings."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.variable_projection import LinearisedRun


class NuisanceElimination:
    """Removes from forcings what parameters, tolerances and the runs' nuisance parameters explain.

    The eliminated numbers are the k parameters, the m tolerances, and the l nuisance parameters of every
    run; N = k + m + l runs.
    """

    def __init__(self, runs: Sequence[LinearisedRun], counted: Sequence[NDArray], regularisation: float):
        """Collect the normal equations of the eliminated numbers.

        Args:
            runs: one estimate, linearised in each run.
            counted: readings that count, per run boolean (values,).
            regularisation: precision added to every number [1].
        """
        k, m = runs[0].slopes.shape[1], runs[0].tolerance_slopes.shape[1]
        self._count = k + m
        own = runs[0].run_slopes.shape[1]
        total = self._count + own * len(runs)
        self._places = [self._place(r, own) for r in range(len(runs))]
        self._columns = [
            np.hstack([run.slopes, run.tolerance_slopes, run.run_slopes]) * each[:, None]
            for run, each in zip(runs, counted, strict=True)
        ]
        # Neither forcings nor numbers explain a reading that does not count: it has no residual.
        self._residuals = [run.residual * each for run, each in zip(runs, counted, strict=True)]
        self._counted = counted
        self._hessian, self._gradient = np.zeros((total, total)), np.zeros(total)
        chi_square = 0.0
        for run, place, columns, residual in zip(
            runs, self._places, self._columns, self._residuals, strict=True
        ):
            chi_square += self._add(run, place, columns, residual)
        tolerances = np.arange(k, self._count)
        self._hessian[tolerances, tolerances] += 1.0
        self._hessian[np.diag_indices_from(self._hessian)] += regularisation
        explained = self._gradient @ np.linalg.solve(self._hessian, self._gradient)
        self.chi_square = float(chi_square - explained)
        """Sum of squares of the residual after the elimination [1]."""

    def _place(self, r: int, own: int) -> NDArray:
        """Indices of the numbers that act in a run, (k + m + l,)."""
        first = self._count + own * r
        return np.r_[0 : self._count, first : first + own]

    def _add(self, run: LinearisedRun, place: NDArray, columns: NDArray, residual: NDArray) -> float:
        """Add a run with its priors; returns its part of the sum of squares [1].

        columns: changes of its readings by each number, (values, numbers). residual: (values,).
        """
        precision, own = 1.0 / run.run_sd**2, place[self._count :]
        self._hessian[np.ix_(place, place)] += columns.T @ columns
        self._hessian[own, own] += precision
        self._gradient[place] += columns.T @ residual
        self._gradient[own] -= precision * run.run_values
        return float(residual @ residual + precision @ run.run_values**2)

    def moment_and_precision(
        self, columns: Sequence[NDArray], *, shared: bool = False
    ) -> tuple[NDArray, NDArray]:
        """Quadratic form of forcings after the elimination.

        Args:
            columns: changes of the outputs by each forcing, per run (values, forcings) [noise
                deviations].
            shared: True where all runs have the same forcings; else each run has its own.

        Returns:
            Moment (forcings,) and precision (forcings, forcings) [1].
        """
        count = columns[0].shape[1] if shared else sum(block.shape[1] for block in columns)
        moment, precision = np.zeros(count), np.zeros((count, count))
        cross = np.zeros((len(self._gradient), count))
        first = 0
        for changes, counted, residual, nuisance, place in zip(
            columns, self._counted, self._residuals, self._columns, self._places, strict=True
        ):
            block = changes * counted[:, None] if not np.all(counted) else changes
            own = slice(first, first + block.shape[1])
            first = 0 if shared else own.stop
            moment[own] += block.T @ residual
            precision[own, own] += block.T @ block
            cross[place, own] += nuisance.T @ block
        solved = np.linalg.solve(self._hessian, np.column_stack([self._gradient, cross]))
        return moment - cross.T @ solved[:, 0], precision - cross.T @ solved[:, 1:]
