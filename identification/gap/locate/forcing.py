"""The least forcing that each state equation needs so that the model meets the recordings.

A forcing that is constant in each of many short windows of the runs is added to one equation at a time.
The outputs are taken as linear in it; what calibrated parameters, starts and tolerances can explain is
eliminated first. `Needed` is the quadratic form that is left; processes.py weighs it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitter import Fitter, Point
from identification.gap.fit.variable_projection import Linear
from identification.gap.locate.sensor_faults import faults, physical
from identification.gap.model.grey_box import Equation, Trace, weighted

WINDOWS = 80
"""Windows per run, at most."""

SAMPLES = 8000
"""Of the runs that are looked at together; at least one run is taken."""

TIME_SHARE = 0.3
"""Share of the windows that is spread evenly in time, the rest going where states move."""

FIXED = 1e-9
"""Precision that keeps directions which no reading tells from being singular."""


@dataclass(frozen=True, kw_only=True)
class Window:
    """A stretch of a run in which a forcing is constant."""

    run: int
    begin: float
    end: float
    """[s]"""
    states: Mapping[str, float]
    """Means over the stretch [SI]."""


@dataclass(frozen=True, kw_only=True)
class Needed:
    """chi_square - 2 pull f + f precision f over forcings f (windows,), in steps of the equation."""

    equation: Equation
    windows: list[Window]
    """Empty for a fault of the readings: its forcings are sizes of a few forms of it."""
    precision: NDArray
    pull: NDArray


@dataclass(frozen=True, kw_only=True)
class Material:
    """What all equations share: the runs, their windows, and the residual that is to be explained."""

    units: Mapping[str, tuple[str, float]]
    """Unit and its size in SI, by state."""
    chi_square: float
    """Of the residual, nuisances eliminated."""
    count: int
    """Trusted readings."""


def candidate(fitter: Fitter, point: Point) -> dict[str, NDArray]:
    """The point's values by symbol, as the plant takes one candidate."""
    values = {symbol: np.array([value]) for symbol, value in fitter.values(point).items()}
    local = {n.symbol: point.local[None, :, j] for j, n in enumerate(point.hypothesis.local)}
    return {**values, **local}


def telling_runs(fitter: Fitter, residuals: Sequence[NDArray]) -> list[int]:
    """The runs with most misfit per sample, as many as are affordable."""
    lengths = np.array([len(run.time) for run in fitter.plant.runs])
    misfit = np.array([np.sum(residual**2) for residual in residuals]) / lengths
    first, *others = np.argsort(-misfit, kind="stable").tolist()
    taken, left = [first], SAMPLES - lengths[first]
    for run in others:
        if lengths[run] <= left:
            taken.append(run)
            left -= lengths[run]
    return sorted(taken)


def needed(fitter: Fitter, point: Point, runs: Sequence[int]) -> tuple[Material, list[Needed]]:
    """The quadratic form of every equation that can lack something, over the runs."""
    plant, values = fitter.plant, candidate(fitter, point)
    states = [plant.states(values, r) for r in runs]
    edges = [window_edges(plant.runs[r].time, traces) for r, traces in zip(runs, states, strict=True)]
    windows = [
        window
        for r, ends, traces in zip(runs, edges, states, strict=True)
        for window in _windows(r, plant.runs[r].time, ends, traces)
    ]
    linear = fitter.linearise([point], runs)[0]
    explain = _Elimination(linear)
    found = []
    for equation in plant.equations:
        if equation.step:
            columns = [
                np.nan_to_num(weighted(plant, r, plant.forced(values, equation, r, ends)))
                for r, ends in zip(runs, edges, strict=True)
            ]
            pull, precision = explain.reduced([c.reshape(-1, c.shape[-1]) for c in columns])
            found.append(Needed(equation=equation, windows=windows, precision=precision, pull=pull))
    for fault in faults(plant, values, runs):
        pull, precision = explain.reduced(fault.changes, shared=True)
        kept = physical(pull, precision, fault.signed)
        if np.any(kept):
            pull, precision = pull[kept], precision[np.ix_(kept, kept)]
            found.append(Needed(equation=fault.place, windows=[], precision=precision, pull=pull))
    material = Material(
        units={name: (trace.unit, trace.scale) for name, trace in states[0].items()},
        chi_square=explain.chi_square,
        count=int(sum(np.sum(plant.runs[r].trusted) for r in runs)),
    )
    return material, found


def window_edges(time: NDArray, traces: Mapping[str, Trace]) -> NDArray:
    """First samples of the windows and the end: dense where states move, none of them empty."""
    steps = [np.abs(np.diff(trace.values)) for trace in traces.values()]
    moved = [step / np.sum(step) for step in steps if np.any(step)]
    even = np.full(len(time) - 1, 1.0 / (len(time) - 1))
    density = TIME_SHARE * even + (1 - TIME_SHARE) * np.mean([*moved, even], axis=0)
    way = np.concatenate([[0.0], np.cumsum(density)]) / np.sum(density)
    ends = np.searchsorted(way, np.linspace(0.0, 1.0, WINDOWS + 1)[1:-1])
    return np.unique([0, *ends, len(time) - 1])


def _windows(run: int, time: NDArray, edges: NDArray, traces: Mapping[str, Trace]) -> list[Window]:
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


class _Elimination:
    """Removes from columns what parameters, tolerances and the runs' own numbers explain."""

    def __init__(self, linear: Sequence[Linear]):
        shared = linear[0].slopes.shape[1] + linear[0].shared.shape[1]
        own = linear[0].local.shape[1]
        total = shared + own * len(linear)
        self.places = [
            np.r_[0:shared, shared + own * r : shared + own * (r + 1)] for r in range(len(linear))
        ]
        self.nuisances = [np.hstack([run.slopes, run.shared, run.local]) for run in linear]
        self.residuals = [run.residual for run in linear]
        hessian, gradient = np.zeros((total, total)), np.zeros(total)
        chi_square = 0.0
        for run, place, columns in zip(linear, self.places, self.nuisances, strict=True):
            precision = 1.0 / run.local_sd**2
            hessian[np.ix_(place, place)] += columns.T @ columns
            hessian[place[shared:], place[shared:]] += precision
            gradient[place] += columns.T @ run.residual
            gradient[place[shared:]] -= precision * run.local_value
            chi_square += run.residual @ run.residual + precision @ run.local_value**2
        tolerances = np.arange(linear[0].slopes.shape[1], shared)
        hessian[tolerances, tolerances] += 1.0
        hessian[np.diag_indices_from(hessian)] += FIXED
        self.hessian, self.gradient = hessian, gradient
        self.chi_square = float(chi_square - gradient @ np.linalg.solve(hessian, gradient))

    def reduced(self, columns: Sequence[NDArray], *, shared: bool = False) -> tuple[NDArray, NDArray]:
        """Pull (forcings,) and precision (forcings, forcings) of columns (values, forcings) by run.

        shared: the runs have the same forcings; else each has its own.
        """
        m = columns[0].shape[1] if shared else sum(block.shape[1] for block in columns)
        pull, precision = np.zeros(m), np.zeros((m, m))
        cross = np.zeros((len(self.gradient), m))
        first = 0
        for block, residual, nuisance, place in zip(
            columns, self.residuals, self.nuisances, self.places, strict=True
        ):
            own = slice(first, first + block.shape[1])
            first = 0 if shared else own.stop
            pull[own] += block.T @ residual
            precision[own, own] += block.T @ block
            cross[place, own] += nuisance.T @ block
        solved = np.linalg.solve(self.hessian, np.column_stack([self.gradient, cross]))
        return pull - cross.T @ solved[:, 0], precision - cross.T @ solved[:, 1:]
