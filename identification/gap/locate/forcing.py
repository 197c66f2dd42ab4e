"""The forcing that each state equation needs so that the model meets the recordings.

A forcing that is constant in each of many short windows is added to one equation at a time. The outputs
are taken as linear in the forcing. What calibrated and nuisance parameters can explain is eliminated
first; a quadratic form in the forcing remains, which localisation.py evaluates.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import Estimate, FittingProblem
from identification.gap.fit.gauss_newton import linearise
from identification.gap.fit.variable_projection import RIDGE, LinearisedRun
from identification.gap.plant import (
    GreyBox,
    StateEquation,
    StateTrace,
    noise_weighted,
    window_forcing,
)
from identification.gap.prepare.sensor_faults import physical_forms, reading_faults

WINDOWS, MOST_WINDOWS = 80, 400
"""Windows of a run in which a forcing is constant, where they follow its motion, and the most of them
elsewhere; where those are too few, only the first part of the run counts. Computing time."""

WINDOWS_TOGETHER, MOST_VALUES = 1200, 8_000_000
"""Most windows of all runs, and most changes of a run's readings by its windows (64 MB), where they are
more than usual: time and memory for matrices of this size."""


@dataclass(frozen=True, kw_only=True)
class Window:
    """A stretch of a run in which a forcing is constant."""

    run: int
    """Index of the run."""
    begin: float
    """Start of the window [s]."""
    end: float
    """End of the window [s]."""
    states: Mapping[str, float]
    """Means of the states over the window, by name [SI]."""


@dataclass(frozen=True, kw_only=True)
class QuadraticForm:
    """chi-square as a function of the forcings f of one equation:

    chi_square - 2 moment f + f precision f, with f (windows,) in steps of the equation.
    """

    equation: StateEquation
    windows: list[Window]
    """Empty for a fault of the readings: its forcings are the sizes of its forms."""
    precision: NDArray
    """(windows, windows) [1]."""
    moment: NDArray
    """(windows,) [1]."""


@dataclass(frozen=True, kw_only=True)
class LocalisationDesign:
    """What the quadratic forms of all equations have in common."""

    units: Mapping[str, tuple[str, float]]
    """Unit of each state in reports, and its size in SI, by the state's name."""
    chi_square: float
    """Sum of squares of the residual without forcing, nuisance parameters eliminated [1]."""
    readings: int
    """Number of trusted readings."""


class NuisanceElimination:
    """Removes from forcings what parameters, tolerances and the runs' nuisance parameters explain.

    The eliminated numbers are the k parameters, the m tolerances, and the l nuisance parameters of every
    run; N = k + m + l runs.
    """

    def __init__(self, runs: Sequence[LinearisedRun], counted: Sequence[NDArray]):
        """Collect the normal equations of the eliminated numbers.

        runs: one estimate, linearised in each run. counted: per run, readings that count, (values,).
        """
        k = runs[0].slopes.shape[1]
        shared = k + runs[0].shared_slopes.shape[1]
        own = runs[0].run_slopes.shape[1]
        total = shared + own * len(runs)
        self._counted = counted
        firsts = [shared + own * r for r in range(len(runs))]
        self._places = [np.r_[0:shared, first : first + own] for first in firsts]
        """Per run, indices of the numbers that act in it, (k + m + l,)."""
        self._columns = [
            np.hstack([run.slopes, run.shared_slopes, run.run_slopes]) * each[:, None]
            for run, each in zip(runs, counted, strict=True)
        ]
        # Neither forcings nor numbers explain a reading that does not count: it has no residual.
        self._residuals = [run.residual * each for run, each in zip(runs, counted, strict=True)]
        self._hessian, self._gradient = np.zeros((total, total)), np.zeros(total)
        chi_square = 0.0
        for run, place, columns, residual in zip(
            runs, self._places, self._columns, self._residuals, strict=True
        ):
            precision, nuisances = 1.0 / run.run_sd**2, place[shared:]
            self._hessian[np.ix_(place, place)] += columns.T @ columns
            self._hessian[nuisances, nuisances] += precision
            self._gradient[place] += columns.T @ residual
            self._gradient[nuisances] -= precision * run.run_values
            chi_square += float(residual @ residual + precision @ run.run_values**2)
        tolerances = np.arange(k, shared)
        self._hessian[tolerances, tolerances] += 1.0
        self._hessian[np.diag_indices_from(self._hessian)] += RIDGE
        explained = self._gradient @ np.linalg.solve(self._hessian, self._gradient)
        self.chi_square = float(chi_square - explained)
        """Sum of squares of the residual after the elimination [1]."""

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


def quadratic_forms(
    problem: FittingProblem, estimate: Estimate, runs: Sequence[int], scale: float
) -> tuple[LocalisationDesign, list[QuadraticForm]]:
    """Quadratic form of every equation that can lack something, and of every fault of the readings.

    Args:
        problem: the plant with its readings.
        estimate: the model whose residual is to be explained.
        runs: indices of the runs.
        scale: the plant's time scale [s].
    """
    plant, values = problem.plant, problem.candidate(estimate)
    traces = [plant.states(values, r) for r in runs]
    times = [plant.runs[r].time for r in runs]
    most = most_windows(len(runs), len(plant.channels) * max(len(t) for t in times))
    first = [int(np.argmax(np.any(plant.runs[r].trusted, axis=0))) for r in runs]
    edges = [
        resolving_edges(t, own, scale, most, begin)
        for t, own, begin in zip(times, traces, first, strict=True)
    ]
    windows = [
        window
        for r, time, ends, own in zip(runs, times, edges, traces, strict=True)
        for window in windows_of(r, time, ends, own)
    ]
    linearised = linearise(problem, [estimate], runs)[0]
    counted = [_counted(plant, r, ends) for r, ends in zip(runs, edges, strict=True)]
    elimination = NuisanceElimination(linearised, counted)
    forms = []
    for equation in plant.equations:
        if equation.step:
            columns = _forced_changes(problem, values, equation, runs, edges)
            moment, precision = elimination.moment_and_precision(columns)
            forms.append(
                QuadraticForm(equation=equation, windows=windows, precision=precision, moment=moment)
            )
    design = LocalisationDesign(
        units={name: (trace.unit, trace.scale) for name, trace in traces[0].items()},
        chi_square=elimination.chi_square,
        readings=int(sum(np.sum(own) for own in counted)),
    )
    return design, [*forms, *_fault_forms(problem, values, runs, elimination)]


def _counted(plant: GreyBox, run: int, edges: NDArray) -> NDArray:
    """Trusted readings that the windows cover, boolean (values,)."""
    counted = plant.runs[run].trusted.copy()
    if edges[-1] < counted.shape[1] - 1:
        counted[:, edges[-1] :] = False
    return counted.ravel()


def _forced_changes(
    problem: FittingProblem,
    values: Mapping[str, NDArray],
    equation: StateEquation,
    runs: Sequence[int],
    edges: Sequence[NDArray],
) -> list[NDArray]:
    """Changes of the outputs by a forcing of each window, per run (values, windows)."""
    plant = problem.plant
    blocks = []
    for r, ends in zip(runs, edges, strict=True):
        forcing = window_forcing(equation, len(plant.runs[r].time), ends)
        blocks.append(np.nan_to_num(noise_weighted(plant, r, plant.forced(values, r, forcing))))
    return [block.reshape(-1, block.shape[-1]) for block in blocks]


def _fault_forms(
    problem: FittingProblem,
    values: Mapping[str, NDArray],
    runs: Sequence[int],
    elimination: NuisanceElimination,
) -> list[QuadraticForm]:
    """Quadratic forms of the faults of the readings, in their physically possible forms."""
    forms = []
    for fault in reading_faults(problem.plant, values, runs):
        moment, precision = elimination.moment_and_precision(fault.changes, shared=True)
        kept = physical_forms(moment, precision, fault.either_sign)
        if np.any(kept):
            form = QuadraticForm(
                equation=fault.place,
                windows=[],
                precision=precision[np.ix_(kept, kept)],
                moment=moment[kept],
            )
            forms.append(form)
    return forms


def most_misfitting_runs(problem: FittingProblem, residuals: Sequence[NDArray]) -> list[int]:
    """Indices of the runs with the largest mean square residual: one, or up to 8000 samples together.

    A run whose readings count late only is taken where there is no other: what the model lacked before
    them shows in them, too, but not where it acted.

    residuals: per run (channels, samples) [noise deviations].
    """
    runs = problem.plant.runs
    lengths = np.array([len(run.time) for run in runs])
    misfit = np.array([np.sum(residual**2) for residual in residuals]) / lengths
    begins = np.array([np.argmax(np.any(run.trusted, axis=0)) for run in runs]) / lengths
    late = begins > 0.1
    if not np.all(late):
        misfit = np.where(late, -1.0, misfit)
    first, *others = [run for run in np.argsort(-misfit, kind="stable").tolist() if misfit[run] >= 0]
    chosen, left = [first], 8000 - lengths[first]
    for run in others:
        if lengths[run] <= left and len(chosen) < WINDOWS_TOGETHER // WINDOWS:
            chosen.append(run)
            left -= lengths[run]
    return sorted(chosen)


def resolving_edges(
    time: NDArray, traces: Mapping[str, StateTrace], scale: float, most: int, first: int
) -> NDArray:
    """Edges of windows that follow the motion: more than usual, and of a part of the run, if need be.

    Args:
        time: sampling instants, (samples,) [s].
        traces: states of the run by name.
        scale: the plant's time scale [s].
        most: most windows.
        first: sample at which such a part begins, with the first reading that counts.

    Returns:
        First sample of each window, and the end of the last one, (windows + 1,).
    """
    edges = window_edges(time, traces, WINDOWS)
    typical = _typical_length(edges, traces) * (time[1] - time[0]) / scale
    # A third of a period still follows the motion; where it does not, a tenth is needed.
    if typical <= 1.5:
        return edges
    needed = int(np.ceil(WINDOWS * typical / 0.5))
    if needed > most:
        part = slice(first, first + max(WINDOWS, int(len(time) * most / needed)))
        traces = {name: replace(trace, values=trace.values[part]) for name, trace in traces.items()}
        return first + window_edges(time[part], traces, most)
    return window_edges(time, traces, needed)


def most_windows(runs: int, values: int) -> int:
    """Most windows of one of several runs.

    runs: number of runs. values: number of readings of the longest one, over all channels.
    """
    most = min(MOST_WINDOWS, WINDOWS_TOGETHER // runs, MOST_VALUES // values)
    return max(WINDOWS, most)


def window_edges(time: NDArray, traces: Mapping[str, StateTrace], windows: int) -> NDArray:
    """First sample of each window and the end of the last one, dense where states move, (windows + 1,).

    time: (samples,) [s]. traces: states of the run by name. windows: most windows. No window is empty.
    """
    uniform = np.full(len(time) - 1, 1.0 / (len(time) - 1))
    motion = np.mean([*_motion(traces), uniform], axis=0)
    density = 0.3 * uniform + 0.7 * motion  # most follow the states
    progress = np.concatenate([[0.0], np.cumsum(density)]) / np.sum(density)
    ends = np.searchsorted(progress, np.linspace(0.0, 1.0, windows + 1)[1:-1])
    return np.unique([0, *ends, len(time) - 1])


def _motion(traces: Mapping[str, StateTrace]) -> list[NDArray]:
    """Share of its path that each state covers between samples, (samples - 1,) [1]; of those that
    move."""
    changes = [np.abs(np.diff(trace.values)) for trace in traces.values()]
    return [change / np.sum(change) for change in changes if np.any(change)]


def _typical_length(edges: NDArray, traces: Mapping[str, StateTrace]) -> float:
    """Length of a window [samples] such that half of the motion lies in shorter ones; 0 at rest.

    Where the plant names no states any motion is possible at any time.
    """
    motion = _motion(traces)
    if not traces:
        return float(np.median(np.diff(edges)))
    if not motion:
        return 0.0
    lengths, inside = np.diff(edges), np.add.reduceat(np.sum(motion, axis=0), edges[:-1])
    order = np.argsort(lengths)
    moved = np.cumsum(inside[order])
    return float(lengths[order][np.searchsorted(moved, 0.5 * moved[-1])])


def windows_of(
    run: int, time: NDArray, edges: NDArray, traces: Mapping[str, StateTrace]
) -> list[Window]:
    """The windows between edges (windows + 1,) of a run with sampling instants (samples,) [s]."""
    lengths = np.diff(edges)
    means = {
        name: np.add.reduceat(trace.values[: edges[-1]], edges[:-1]) / lengths
        for name, trace in traces.items()
    }
    return [
        Window(
            run=run,
            begin=float(time[edges[j]]),
            end=float(time[edges[j + 1]]),
            states={name: float(mean[j]) for name, mean in means.items()},
        )
        for j in range(len(lengths))
    ]
