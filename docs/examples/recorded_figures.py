"""Pictures of a diagnosis of recorded plants: model and recording, what is left, what is missing."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from identification.gap.diagnosis import Diagnosis
from identification.gap.gap_json import drawn_term
from identification.gap.prediction import predict
from identification.gap.report_figures import missing_term_figure

RECALIBRATED, WITH_CAUSES, MEASURED = "tab:orange", "tab:blue", "black"


def write_figures(diagnosis: Diagnosis, folder: Path, name: str) -> list[Path]:
    """Write recorded-NAME.png, and recorded-NAME-left.png where a state explains what is left."""
    figures = {f"recorded-{name}.png": prediction_figure(diagnosis)}
    term = drawn_term(diagnosis.remaining)
    if term is not None:
        figures[f"recorded-{name}-left.png"] = missing_term_figure(term)
    folder.mkdir(parents=True, exist_ok=True)
    for file, figure in figures.items():
        figure.savefig(folder / file, dpi=100, bbox_inches="tight")
    return [folder / file for file in figures]


def prediction_figure(diagnosis: Diagnosis) -> Figure:
    """The held-out run of middling error: readings and both models above, both errors below."""
    plant, problem = diagnosis.ranking.problem.plant, diagnosis.ranking.problem
    models = {"recalibrated model": (diagnosis.ranking.recalibrated.estimate, RECALIBRATED)}
    if diagnosis.best:
        label = "with " + " and ".join(each.replace("_", " ") for each in diagnosis.best.effects)
        models[label] = (diagnosis.best.hypothesis.estimate, WITH_CAUSES)
    residuals = {label: predict(problem, estimate).residuals for label, (estimate, _) in models.items()}
    run = _middling_run(diagnosis, residuals["recalibrated model"])
    own = plant.runs[run]
    channels = len(plant.channels)
    figure = Figure(figsize=(9.5, 2.6 * channels + 1.2), layout="constrained")
    rows = figure.subplots(2 * channels, 1, sharex=True, height_ratios=[2.0, 1.0] * channels)
    for c, channel in enumerate(plant.channels):
        above, below = rows[2 * c], rows[2 * c + 1]
        measured = np.where(own.trusted[c], own.measured[c], np.nan) / channel.scale
        for label, (_, colour) in models.items():
            error = residuals[label][run][c] * channel.known_noise / channel.scale
            above.plot(own.time, measured - error, color=colour, linewidth=1.2, label=label)
            below.plot(own.time, np.where(own.trusted[c], error, np.nan), color=colour, linewidth=0.9)
        above.plot(own.time, measured, color=MEASURED, linewidth=0.8, label="measured")
        _finish(above, f"{channel.name} [{channel.unit}]")
        _finish(below, f"error [{channel.unit}]")
    figure.legend(*rows[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    rows[-1].set_xlabel("time [s]")
    figure.suptitle(f"{own.name}, never fitted to", fontsize="medium")
    counted = own.time[np.any(own.trusted, axis=0)]
    rows[-1].set_xlim(counted[0], counted[-1])
    return figure


def _finish(axes: Axes, label: str) -> None:
    axes.set_ylabel(label, fontsize="small")
    axes.grid(alpha=0.3)


def _middling_run(diagnosis: Diagnosis, residuals: Sequence[NDArray]) -> int:
    """The held-out run whose mean squared error is the median of all.

    residuals: of each run, (channels, samples) [noise deviations].
    """
    runs = diagnosis.ranking.problem.plant.runs
    held_out = [r for r, run in enumerate(runs) if run.held_out]
    ordered = sorted(held_out, key=lambda r: float(np.mean(residuals[r] ** 2)))
    return ordered[len(ordered) // 2]
