"""Pictures of a blind check."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from epv_env.plant.effects.record import COMPONENTS
from epv_env.plant.effects.registry import CATALOGUE
from identification.studies.blind.calibration_figure import reliability_figure
from identification.studies.blind.detection import detection_by_gap
from identification.studies.blind.kinds import ABSORBED, NOMINAL, ONE_CAUSE, PARAMETER
from identification.studies.blind.score import TrialScore, component_of
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.studies.blind.summary import confusion_matrix
from identification.studies.proportion import Proportion
from identification.valve_gap.causes import PARAMETER_COMPONENTS

NO_GAP, UNKNOWN, SEVERAL, NO_TRUE_CAUSE = "no gap", "unknown", "several", "nothing"
"""Labels of rows and columns that are no cause."""

CELL, ROOM_FOR_NAMES = 0.4, 2.0
"""Of a matrix: size of a cell and of the names beside it [inch]."""


def component_figure(trials: Sequence[TrialScore]) -> Figure:
    """True against diagnosed component, for trials with at most one cause."""
    names = list(COMPONENTS)
    pairs = [
        (
            _true_label(trial, component_of),
            NO_GAP if trial.verdict == "no_gap" else trial.component or UNKNOWN,
        )
        for trial in _with_one_cause_at_most(trials)
    ]
    rows, columns = [NO_TRUE_CAUSE, *names], [NO_GAP, *names, UNKNOWN]
    return _matrix_figure(confusion_matrix(pairs, rows, columns), rows, columns)


def cause_figure(trials: Sequence[TrialScore]) -> Figure:
    """True cause against the first that is named, for trials with at most one cause."""
    names = [*CATALOGUE, *(PARAMETER + symbol for symbol in PARAMETER_COMPONENTS)]
    pairs = [
        (_true_label(trial, str), _diagnosed_label(trial)) for trial in _with_one_cause_at_most(trials)
    ]
    rows, columns = [NO_TRUE_CAUSE, *names], [NO_GAP, *names, SEVERAL, UNKNOWN]
    return _matrix_figure(confusion_matrix(pairs, rows, columns), rows, columns)


def detection_figure(trials: Sequence[TrialScore], settings: BlindSettings = DEFAULTS) -> Figure:
    """Proportions of detected gaps and of correct causes, over the explainable gap."""
    figure = Figure(figsize=(8, 4), layout="constrained")
    axes = figure.add_subplot()
    bins = [bin_ for bin_ in detection_by_gap(trials, settings) if bin_.detected.of]
    middle = np.sqrt([bin_.low * bin_.high for bin_ in bins])
    _draw_proportions(axes, 0.96 * middle, [bin_.detected for bin_ in bins], "a gap is found")
    _draw_proportions(
        axes, 1.04 * middle, [bin_.first_cause_correct for bin_ in bins], "first cause right"
    )
    axes.axvline(
        settings.explainable_threshold - 1.0,
        color="black",
        linestyle=":",
        label="counts as something to explain",
    )
    axes.set_xscale("log")
    axes.set_xlim(settings.gap_bins[0], settings.gap_bins[-1])
    axes.set_xlabel("explainable gap above the floor of 1 (noise-free)")
    axes.set_ylabel("share of trials")
    axes.set_ylim(-0.03, 1.03)
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right")
    return figure


FIGURES: dict[str, Callable[[Sequence[TrialScore]], Figure]] = {
    "blind-detection": detection_figure,
    "blind-components": component_figure,
    "blind-causes": cause_figure,
    "blind-reliability": reliability_figure,
}
"""Figures for documents by file name."""


def _draw_proportions(axes: Axes, gaps: NDArray, proportions: Sequence[Proportion], name: str) -> None:
    """Proportions with their intervals at these gaps [-], (bins,)."""
    middle = np.array([found.hits / found.of for found in proportions])
    ends = np.array([found.interval for found in proportions]).reshape(-1, 2)
    errors = np.maximum([middle - ends[:, 0], ends[:, 1] - middle], 0.0)
    axes.errorbar(gaps, middle, errors, fmt="o-", capsize=3, label=name)


def _with_one_cause_at_most(trials: Sequence[TrialScore]) -> list[TrialScore]:
    """Diagnosed trials with one cause to name, or none."""
    return [
        trial
        for trial in trials
        if trial.verdict != "failed"
        and (trial.kind in (NOMINAL, ONE_CAUSE) or (trial.kind == ABSORBED and len(trial.causes) == 1))
    ]


def _true_label(trial: TrialScore, name: Callable[[str], str]) -> str:
    return name(trial.causes[0]) if trial.causes else NO_TRUE_CAUSE


def _diagnosed_label(trial: TrialScore) -> str:
    if trial.verdict == "no_gap":
        return NO_GAP
    if not trial.first_cause:
        return UNKNOWN
    return trial.first_cause[0] if len(trial.first_cause) == 1 else SEVERAL


def _matrix_figure(counts: NDArray, rows: Sequence[str], columns: Sequence[str]) -> Figure:
    """Counts (rows, columns) coloured by their share of the row; without empty rows and columns."""
    keep_rows = np.flatnonzero(counts.sum(axis=1)).tolist()
    keep_columns = np.flatnonzero(counts.sum(axis=0)).tolist()
    shown = counts[np.ix_(keep_rows, keep_columns)]
    size = [ROOM_FOR_NAMES + CELL * len(kept) for kept in (keep_columns, keep_rows)]
    figure = Figure(figsize=(size[0], size[1]), layout="constrained")
    axes = figure.add_subplot()
    axes.set_xlabel("diagnosed")
    axes.set_ylabel("true")
    if not shown.size:
        return figure
    share = shown / shown.sum(axis=1, keepdims=True)
    axes.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for row, column in np.argwhere(shown).tolist():
        colour = "white" if share[row, column] > 0.5 else "black"
        text = str(shown[row, column])
        axes.text(column, row, text, ha="center", va="center", color=colour, fontsize=8)
    names = [columns[k] for k in keep_columns]
    axes.set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize=8)
    axes.set_yticks(range(len(keep_rows)), [rows[k] for k in keep_rows], fontsize=8)
    return figure
