"""Pictures of a blind check."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from epv_env.plant.effects.record import COMPONENTS
from epv_env.plant.effects.registry import CATALOGUE
from identification.studies.blind.commitments import NOTHING_LEFT
from identification.studies.blind.score import ABSORBED, Scored, component_of
from identification.studies.blind.summary import EDGES, Share, by_size, confusion
from identification.studies.blind.truth import NONE, ONE, PARAMETER
from identification.valve_gap.causes import PARAMETER_COMPONENTS

NO_GAP, UNKNOWN, A_PAIR, NOTHING = "no gap", "unknown", "two effects", "nothing"


def components(trials: Sequence[Scored]) -> Figure:
    """Where one cause lies against where it is said to lie."""
    names = list(COMPONENTS)
    pairs = [
        (_true(trial, component_of), NO_GAP if trial.verdict == "no_gap" else trial.component or UNKNOWN)
        for trial in _single(trials)
    ]
    counts = confusion(pairs, [NOTHING, *names], [NO_GAP, *names, UNKNOWN])
    return _matrix(counts, [NOTHING, *names], [NO_GAP, *names, UNKNOWN], size=(7.5, 6.5))


def causes(trials: Sequence[Scored]) -> Figure:
    """One true cause against the first that is named."""
    names = [*CATALOGUE, *(PARAMETER + symbol for symbol in PARAMETER_COMPONENTS)]
    pairs = [(_true(trial, str), _said(trial)) for trial in _single(trials)]
    counts = confusion(pairs, [NOTHING, *names], [NO_GAP, *names, A_PAIR, UNKNOWN])
    return _matrix(counts, [NOTHING, *names], [NO_GAP, *names, A_PAIR, UNKNOWN], size=(13, 12))


def detection(trials: Sequence[Scored]) -> Figure:
    """How large the explainable gap must be to be found, and to be put down to the right cause."""
    figure = Figure(figsize=(8, 4), layout="constrained")
    axes = figure.add_subplot()
    bins = [found for found in by_size(trials) if found.detected.of]
    at = np.sqrt([found.low * found.high for found in bins])
    _shares(axes, 0.96 * at, [found.detected for found in bins], "a gap is found")
    _shares(axes, 1.04 * at, [found.first_right for found in bins], "first cause right")
    axes.axvline(
        NOTHING_LEFT - 1.0, color="black", linestyle=":", label="counts as something to explain"
    )
    axes.set_xscale("log")
    axes.set_xlim(EDGES[0], EDGES[-1])
    axes.set_xlabel("explainable gap above the floor of 1 (noise-free)")
    axes.set_ylabel("share of trials")
    axes.set_ylim(-0.03, 1.03)
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right")
    return figure


def _shares(axes: Axes, at: NDArray, shares: Sequence[Share], name: str) -> None:
    middle = np.array([share.hits / share.of for share in shares])
    ends = np.array([share.interval for share in shares]).reshape(-1, 2)
    errors = np.maximum([middle - ends[:, 0], ends[:, 1] - middle], 0.0)
    axes.errorbar(at, middle, errors, fmt="o-", capsize=3, label=name)


def _single(trials: Sequence[Scored]) -> list[Scored]:
    """Trials with one cause to name, or none."""
    return [
        trial
        for trial in trials
        if trial.verdict != "failed"
        and (trial.kind in (NONE, ONE) or (trial.kind == ABSORBED and len(trial.effects) == 1))
    ]


def _true(trial: Scored, name: Callable[[str], str]) -> str:
    return name(trial.effects[0]) if trial.effects else NOTHING


def _said(trial: Scored) -> str:
    if trial.verdict == "no_gap":
        return NO_GAP
    if not trial.first:
        return UNKNOWN
    return trial.first[0] if len(trial.first) == 1 else A_PAIR


def _matrix(
    counts: NDArray, rows: Sequence[str], columns: Sequence[str], *, size: tuple[float, float]
) -> Figure:
    """Rows of shares with their counts; rows and columns without a trial are left out."""
    keep_rows = np.flatnonzero(counts.sum(axis=1)).tolist()
    keep_columns = np.flatnonzero(counts.sum(axis=0)).tolist()
    shown = counts[np.ix_(keep_rows, keep_columns)]
    figure = Figure(figsize=size, layout="constrained")
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
