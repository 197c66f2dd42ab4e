"""The forcing that each state equation needs so that the model meets the recordings.

A forcing that is constant in each of many short windows is added to one equation at a time. The outputs
are taken as linear in the forcing. What calibrated and nuisance parameters can explain is eliminated
first; a quadratic form in the forcing remains, which forcing_processes.py evaluates.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.hypothesis import Estimate
from identification.gap.fit.linearisation import linearise
from identification.gap.locate.nuisance_elimination import NuisanceElimination
from identification.gap.locate.sensor_faults import physical_forms, reading_faults
from identification.gap.locate.settings import LocalisationSettings
from identification.gap.locate.windows import Window, most_windows, resolving_edges, windows_of
from identification.gap.model.grey_box import GreyBox, noise_weighted
from identification.gap.model.state_equation import StateEquation


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


def quadratic_forms(
    problem: FittingProblem,
    estimate: Estimate,
    runs: Sequence[int],
    scale: float,
    settings: LocalisationSettings,
) -> tuple[LocalisationDesign, list[QuadraticForm]]:
    """Quadratic form of every equation that can lack something, and of every fault of the readings.

    Args:
        problem: the plant with its readings.
        estimate: the model whose residual is to be explained.
        runs: indices of the runs.
        scale: the plant's time scale [s].
        settings: windows and forms of faults.
    """
    plant, values = problem.plant, problem.candidate(estimate)
    traces = [plant.states(values, r) for r in runs]
    times = [plant.runs[r].time for r in runs]
    most = most_windows(len(runs), len(plant.channels) * max(len(t) for t in times), settings)
    first = [int(np.argmax(np.any(plant.runs[r].trusted, axis=0))) for r in runs]
    edges = [
        resolving_edges(t, own, scale, most, begin, settings)
        for t, own, begin in zip(times, traces, first, strict=True)
    ]
    windows = [
        window
        for r, time, ends, own in zip(runs, times, edges, traces, strict=True)
        for window in windows_of(r, time, ends, own)
    ]
    linearised = linearise(problem, [estimate], runs)[0]
    counted = [_counted(plant, r, ends) for r, ends in zip(runs, edges, strict=True)]
    elimination = NuisanceElimination(linearised, counted, settings.regularisation)
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
    return design, [*forms, *_fault_forms(problem, values, runs, elimination, settings)]


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
    blocks = [
        np.nan_to_num(noise_weighted(plant, r, plant.forced(values, equation, r, ends)))
        for r, ends in zip(runs, edges, strict=True)
    ]
    return [block.reshape(-1, block.shape[-1]) for block in blocks]


def _fault_forms(
    problem: FittingProblem,
    values: Mapping[str, NDArray],
    runs: Sequence[int],
    elimination: NuisanceElimination,
    settings: LocalisationSettings,
) -> list[QuadraticForm]:
    """Quadratic forms of the faults of the readings, in their physically possible forms."""
    forms = []
    for fault in reading_faults(problem.plant, values, runs, settings):
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
