"""Windows of the runs in which a forcing is constant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.locate.settings import LocalisationSettings
from identification.gap.model.state_equation import StateTrace


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


def most_misfitting_runs(
    problem: FittingProblem, residuals: Sequence[NDArray], settings: LocalisationSettings
) -> list[int]:
    """Indices of the runs with the largest mean square residual, up to a number of samples together.

    A run whose readings count late only is taken where there is no other: what the model lacked before
    them shows in them, too, but not where it acted.

    residuals: per run (channels, samples) [noise deviations].
    """
    runs, samples = problem.plant.runs, settings.samples
    lengths = np.array([len(run.time) for run in runs])
    misfit = np.array([np.sum(residual**2) for residual in residuals]) / lengths
    begins = np.array([np.argmax(np.any(run.trusted, axis=0)) for run in runs]) / lengths
    late = begins > settings.late_readings
    if not np.all(late):
        misfit = np.where(late, -1.0, misfit)
    first, *others = [run for run in np.argsort(-misfit, kind="stable").tolist() if misfit[run] >= 0]
    chosen, left = [first], samples - lengths[first]
    for run in others:
        if lengths[run] <= left:
            chosen.append(run)
            left -= lengths[run]
    return sorted(chosen)


def resolving_edges(
    time: NDArray,
    traces: Mapping[str, StateTrace],
    scale: float,
    most: int,
    first: int,
    settings: LocalisationSettings,
) -> NDArray:
    """Edges of windows that follow the motion: more than usual, and of a part of the run, if need be.

    Args:
        time: sampling instants, (samples,) [s].
        traces: states of the run by name.
        scale: the plant's time scale [s].
        most: most windows.
        first: sample at which such a part begins, with the first reading that counts.
        settings: usual number and length of windows.

    Returns:
        First sample of each window, and the end of the last one, (windows + 1,).
    """
    edges = window_edges(time, traces, settings.windows, settings)
    typical = _typical_length(edges, traces) * (time[1] - time[0]) / scale
    if typical <= settings.longest_window:
        return edges
    needed = int(np.ceil(settings.windows * typical / settings.resolved_window))
    if needed > most:
        part = slice(first, first + max(settings.windows, int(len(time) * most / needed)))
        traces = {name: replace(trace, values=trace.values[part]) for name, trace in traces.items()}
        return first + window_edges(time[part], traces, most, settings)
    return window_edges(time, traces, needed, settings)


def most_windows(runs: int, values: int, settings: LocalisationSettings) -> int:
    """Most windows of one of several runs.

    runs: number of runs. values: number of readings of the longest one, over all channels.
    """
    most = min(settings.most_windows, settings.windows_together // runs, settings.most_values // values)
    return max(settings.windows, most)


def window_edges(
    time: NDArray, traces: Mapping[str, StateTrace], windows: int, settings: LocalisationSettings
) -> NDArray:
    """First sample of each window and the end of the last one, dense where states move, (windows + 1,).

    time: (samples,) [s]. traces: states of the run by name. windows: most windows. No window is empty.
    """
    uniform = np.full(len(time) - 1, 1.0 / (len(time) - 1))
    share = settings.uniform_share
    density = share * uniform + (1 - share) * np.mean([*_motion(traces), uniform], axis=0)
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
