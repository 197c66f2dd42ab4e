"""The reliability diagram of a blind check."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification.studies.blind.calibration import (
    FIRST,
    INCLUSION,
    ReliabilityBin,
    answers_by_trial,
    reliability,
)
from identification.studies.blind.score import TrialScore
from identification.studies.blind.settings import DEFAULTS, BlindSettings


def reliability_figure(trials: Sequence[TrialScore], settings: BlindSettings = DEFAULTS) -> Figure:
    """Share that came true over the stated probability: of first causes, and of each effect."""
    figure = Figure(figsize=(8, 4), layout="constrained")
    answers = answers_by_trial(trials)
    for axes, name in zip(figure.subplots(1, 2, sharey=True), (FIRST, INCLUSION), strict=True):
        _draw_bins(axes, reliability(answers[name], settings))
        axes.set_title(name)
        axes.set_xlabel("stated probability")
    figure.axes[0].set_ylabel("share that is true")
    return figure


def _draw_bins(axes: Axes, bins: Sequence[ReliabilityBin]) -> None:
    """Shares with exact intervals, the number of answers beside each, and the line of calibration."""
    axes.plot([0, 1], [0, 1], color="black", linestyle=":", label="calibrated")
    stated = np.array([bin_.mean_probability for bin_ in bins])
    found = np.array([bin_.right.hits / bin_.right.of for bin_ in bins])
    ends = np.array([bin_.right.interval for bin_ in bins]).reshape(-1, 2)
    errors = np.maximum([found - ends[:, 0], ends[:, 1] - found], 0.0)
    axes.errorbar(stated, found, errors, fmt="o", capsize=3)
    for x, y, bin_ in zip(stated, found, bins, strict=True):
        axes.annotate(str(bin_.right.of), (x, y), (5, 3), textcoords="offset points", fontsize=8)
    axes.set_xlim(-0.03, 1.06)
    axes.set_ylim(-0.03, 1.06)
    axes.grid(alpha=0.3)
    axes.legend(loc="upper left")
